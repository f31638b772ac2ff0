"""Compiles the paper's five-link chain, evaluates it for one state and for a batch, and prints what came out."""

import numpy as np

import eomgen

scene = eomgen.chain(5)  # point masses on massless links of free length: ten coordinates
model = eomgen.compile(scene, method="matrix")  # from the cache, if it was compiled before

q = np.array([1.5, 1.2, 0.9, 1.9, 1.6] + [1.0] * 5)  # five angles (rad), five lengths (m)
v = np.zeros(10)
u = np.zeros(10)
a = model.forward_dynamics(q, v, u, model.p)
for name, value in zip(model.v_names, a, strict=True):
    print(f"d/dt {name:17} {value:9.4f}")

again = model.inverse_dynamics(q, v, a, model.p)
print(f"inputs that give these accelerations: at most {abs(again).max():.0e} from zero")

states = np.random.default_rng(1).normal(q, 0.1, size=(100_000, 10))
batch = model.forward_dynamics(states, v, u, model.p)
print(f"a batch: {batch.shape[0]} states, accelerations of shape {batch.shape}")
