"""The bar with Taichi: MLS-MPM as in its example mpm88/mpm99, quadratic B-splines, APIC, f64."""

import sys

import bar_common
import taichi as ti

threads = int(sys.argv[1])
ti.init(arch=ti.cpu, default_fp=ti.f64, cpu_max_num_threads=threads, log_level=ti.ERROR)
b = bar_common.bar()
position, velocity, volume = bar_common.points(b)
count = len(position)
h = b["length"] / b["cells"]
inverse = 1.0 / h
dt = b["step"]
mass = b["density"] * volume
shear = 0.5 * b["young"]  # nu = 0: the other Lame constant is 0
# Room of four cells around the bar.
room = 4
nodes = (b["cells"] + 2 * room + 1, round(b["height"] * inverse) + 2 * room + 1)

x = ti.Vector.field(2, float, count)
v = ti.Vector.field(2, float, count)
c = ti.Matrix.field(2, 2, float, count)
f = ti.Matrix.field(2, 2, float, count)
grid_v = ti.Vector.field(2, float, nodes)
grid_m = ti.field(float, nodes)


@ti.kernel
def step():
    for i in ti.grouped(grid_m):
        grid_v[i] = ti.Vector([0.0, 0.0])
        grid_m[i] = 0.0
    for p in x:
        base = (x[p] * inverse - 0.5).cast(int)
        fx = x[p] * inverse - base.cast(float)
        w = [0.5 * (1.5 - fx) ** 2, 0.75 - (fx - 1.0) ** 2, 0.5 * (fx - 0.5) ** 2]
        f[p] = (ti.Matrix.identity(float, 2) + dt * c[p]) @ f[p]
        # Small strains: the linear law, as the strains of the bar are 1e-7.
        strain = 0.5 * (f[p] + f[p].transpose()) - ti.Matrix.identity(float, 2)
        stress = 2.0 * shear * strain
        affine = (-dt * volume * 4.0 * inverse * inverse) * stress + mass * c[p]
        for i, j in ti.static(ti.ndrange(3, 3)):
            offset = ti.Vector([i, j])
            away = (offset.cast(float) - fx) * h
            weight = w[i][0] * w[j][1]
            grid_v[base + offset] += weight * (mass * v[p] + affine @ away)
            grid_m[base + offset] += weight * mass
    for i in ti.grouped(grid_m):
        if grid_m[i] > 0.0:
            grid_v[i] /= grid_m[i]
    for p in x:
        base = (x[p] * inverse - 0.5).cast(int)
        fx = x[p] * inverse - base.cast(float)
        w = [0.5 * (1.5 - fx) ** 2, 0.75 - (fx - 1.0) ** 2, 0.5 * (fx - 0.5) ** 2]
        new_v = ti.Vector.zero(float, 2)
        new_c = ti.Matrix.zero(float, 2, 2)
        for i, j in ti.static(ti.ndrange(3, 3)):
            offset = ti.Vector([i, j])
            away = (offset.cast(float) - fx) * h
            weight = w[i][0] * w[j][1]
            g = grid_v[base + offset]
            new_v += weight * g
            new_c += 4.0 * inverse * inverse * weight * g.outer_product(away)
        v[p] = new_v
        c[p] = new_c
        x[p] += dt * new_v


def reset():
    x.from_numpy(position + room * h)
    v.from_numpy(velocity)
    for own, matrices in zip((c, f), bar_common.gradients(b)):
        own.from_numpy(matrices)


def warm():
    reset()
    step()
    reset()
    ti.sync()


def advance(steps):
    for _ in range(steps):
        step()
    ti.sync()


bar_common.run("Taichi", threads, advance, lambda: v.to_numpy()[:, 0], warm)
