"""The speed of compiled modules, beside hand-written C and what users would pick instead.

`eomgen bench speed` runs every contender of the targets in a fresh process, one after another, the whole set in
several rounds (`plan`, made of `cells` and `probes`); a ratio is taken within a round. Every process checks its
answers, a sample of them against 60 digits, before it measures. It writes `speed.json`; `speed.md` (`page`) and
`speed.png` (`picture`) are made from that file alone (`data`, `targets`).
"""
