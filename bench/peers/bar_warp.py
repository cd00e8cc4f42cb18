"""The bar with Warp on the CPU: the same scheme as bar_taichi.py in Warp's kernels, f64. Warp's CPU kernels run in one thread."""

import sys

import bar_common
import warp as wp

threads = int(sys.argv[1])
wp.config.quiet = True
wp.init()
b = bar_common.bar()
position, velocity, volume = bar_common.points(b)
count = len(position)
h = b["length"] / b["cells"]
room = 4
columns, rows = b["cells"] + 2 * room + 1, round(b["height"] / h) + 2 * room + 1

H = wp.constant(wp.float64(h))
INVERSE = wp.constant(wp.float64(1.0 / h))
DT = wp.constant(wp.float64(b["step"]))
VOLUME = wp.constant(wp.float64(volume))
MASS = wp.constant(wp.float64(b["density"] * volume))
SHEAR = wp.constant(wp.float64(0.5 * b["young"]))
ROWS = wp.constant(rows)


@wp.func
def weights(fx: wp.float64, k: int):
    half = wp.float64(0.5)
    if k == 0:
        return half * (wp.float64(1.5) - fx) * (wp.float64(1.5) - fx)
    if k == 1:
        return wp.float64(0.75) - (fx - wp.float64(1.0)) * (fx - wp.float64(1.0))
    return half * (fx - half) * (fx - half)


@wp.kernel
def scatter(
    x: wp.array(dtype=wp.vec2d), v: wp.array(dtype=wp.vec2d), c: wp.array(dtype=wp.mat22d),
    f: wp.array(dtype=wp.mat22d), grid_v: wp.array(dtype=wp.vec2d), grid_m: wp.array(dtype=wp.float64),
):
    p = wp.tid()
    one = wp.identity(n=2, dtype=wp.float64)
    bx = int(x[p][0] * INVERSE - wp.float64(0.5))
    by = int(x[p][1] * INVERSE - wp.float64(0.5))
    fx = x[p][0] * INVERSE - wp.float64(bx)
    fy = x[p][1] * INVERSE - wp.float64(by)
    new_f = (one + DT * c[p]) * f[p]
    f[p] = new_f
    strain = wp.float64(0.5) * (new_f + wp.transpose(new_f)) - one
    stress = wp.float64(2.0) * SHEAR * strain
    affine = (-DT * VOLUME * wp.float64(4.0) * INVERSE * INVERSE) * stress + MASS * c[p]
    for i in range(3):
        for j in range(3):
            weight = weights(fx, i) * weights(fy, j)
            away = wp.vec2d((wp.float64(float(i)) - fx) * H, (wp.float64(float(j)) - fy) * H)
            node = (bx + i) * ROWS + by + j
            wp.atomic_add(grid_v, node, weight * (MASS * v[p] + affine * away))
            wp.atomic_add(grid_m, node, weight * MASS)


@wp.kernel
def update(grid_v: wp.array(dtype=wp.vec2d), grid_m: wp.array(dtype=wp.float64)):
    i = wp.tid()
    if grid_m[i] > wp.float64(0.0):
        grid_v[i] = grid_v[i] / grid_m[i]


@wp.kernel
def gather(
    x: wp.array(dtype=wp.vec2d), v: wp.array(dtype=wp.vec2d), c: wp.array(dtype=wp.mat22d),
    grid_v: wp.array(dtype=wp.vec2d),
):
    p = wp.tid()
    bx = int(x[p][0] * INVERSE - wp.float64(0.5))
    by = int(x[p][1] * INVERSE - wp.float64(0.5))
    fx = x[p][0] * INVERSE - wp.float64(bx)
    fy = x[p][1] * INVERSE - wp.float64(by)
    new_v = wp.vec2d(wp.float64(0.0), wp.float64(0.0))
    new_c = wp.mat22d(wp.float64(0.0), wp.float64(0.0), wp.float64(0.0), wp.float64(0.0))
    for i in range(3):
        for j in range(3):
            weight = weights(fx, i) * weights(fy, j)
            away = wp.vec2d((wp.float64(float(i)) - fx) * H, (wp.float64(float(j)) - fy) * H)
            g = grid_v[(bx + i) * ROWS + by + j]
            new_v += weight * g
            new_c += (wp.float64(4.0) * INVERSE * INVERSE * weight) * wp.outer(g, away)
    v[p] = new_v
    c[p] = new_c
    x[p] = x[p] + DT * new_v


with wp.ScopedDevice("cpu"):
    x = wp.zeros(count, dtype=wp.vec2d)
    v = wp.zeros(count, dtype=wp.vec2d)
    c = wp.zeros(count, dtype=wp.mat22d)
    f = wp.zeros(count, dtype=wp.mat22d)
    grid_v = wp.zeros(columns * rows, dtype=wp.vec2d)
    grid_m = wp.zeros(columns * rows, dtype=wp.float64)

    def reset():
        x.assign(position + room * h)
        v.assign(velocity)
        for own, matrices in zip((c, f), bar_common.gradients(b)):
            own.assign(matrices)

    def advance(steps):
        for _ in range(steps):
            grid_v.zero_()
            grid_m.zero_()
            wp.launch(scatter, dim=count, inputs=[x, v, c, f, grid_v, grid_m])
            wp.launch(update, dim=columns * rows, inputs=[grid_v, grid_m])
            wp.launch(gather, dim=count, inputs=[x, v, c, grid_v])

    def warm():
        reset()
        advance(1)
        reset()

    bar_common.run("Warp", threads, advance, lambda: v.numpy()[:, 0], warm)
