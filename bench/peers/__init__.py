"""What users would pick instead, one script each, on one mechanism: ``python bench/peers/NAME.py --json``."""
