"""Formula families, one file each: steady-state forces from slip and load.

Every family offers two functions of its block `p` (see mjchair.tire.block):

- ``forces(p, fz, kappa, tan_alpha, gamma, speed, direction) -> (fx, fy, mx, my, mz)`` in ISO-W:
  N, 1, 1, rad, m/s, and the direction of rolling in [-1, 1]; `my` is for forward rolling.
- ``stiffness(p, fz, gamma, speed) -> (c_kappa, c_alpha, d_x, d_y)``: slopes at zero slip
  (N, N/rad) and peaks (N), all positive.

They are plain Python that Numba compiles when compiled code calls them.
"""
