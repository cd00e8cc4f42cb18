# ---
# jupyter:
#   jupytext:
#     text_representation:
#       extension: .py
#       format_name: percent
#   kernelspec:
#     display_name: Python 3
#     language: python
#     name: python3
# ---

# %% [markdown]
# # A ball hits a beam
#
# A steel ball falls on a simply supported beam (Singer 2022, after Timoshenko's problem). We run the scene of the
# catalogue, look at it, change the material of the beam, and see what a finer grid costs and brings.

# %%
import tandem

scene = tandem.Scene("singer2022/beam_single", variant="quick")
scene.check()  # what the program warns of; it raises SceneError if the scene cannot be run

# %% [markdown]
# ## One run
# The checks of the scene come with their sources. `checks()` raises if one fails.

# %%
run = tandem.run(scene.having({"output.frames": 2e-5}), "runs/beam", report=True)
run.checks()[["name", "value", "expected", "pass"]]

# %%
history = run.history
print(f"largest force {history['force'].max():.2f} N at {history['time'][history['force'].idxmax()] * 1e6:.0f} us")
history[["time", "force", "midspan"]].iloc[::60]

# %% [markdown]
# The frames are numpy arrays; `.pyvista()` makes a mesh of one. Here the deflection along the beam at the end.

# %%
first, last = run.frames[0].meshes["points"], run.frames[-1].meshes["points"]
rows = first.points[:, 1] == first.points[:, 1].min()
sag = first.points[rows, 1] - last.points[rows, 1]
print(f"deflection of the lowest row: {sag.max() * 1e6:.3f} um, at x = {first.points[rows, 0][sag.argmax()]:.4f} m")

# %% [markdown]
# The report of the run, as the browser shows it:

# %%
run

# %% [markdown]
# ## Three materials
# Aluminium and glass deflect more than steel, and let the ball go later. The checks are those of steel, so they are left out.

# %%
MATERIALS = {"steel": (215.82e9, 0.289, 7960.0), "aluminium": (70e9, 0.33, 2700.0), "glass": (64e9, 0.22, 2500.0)}  # E, nu, density
beams = {}
for name, (young, nu, density) in MATERIALS.items():
    elastic = {"bulk_modulus": young / (3 * (1 - 2 * nu)), "shear_modulus": young / (2 * (1 + nu))}
    values = {"mpm.material.0.density": density, "mpm.material.0.model": {"linear_elastic": elastic}, "check": []}
    beams[name] = tandem.run(scene.having(values), f"runs/beam-{name}")
largest = {name: beam.history["midspan"].max() * 1e6 for name, beam in beams.items()}
forces = {name: beam.history["force"].max() for name, beam in beams.items()}
for name in MATERIALS:
    print(f"{name:10} largest force {forces[name]:.2f} N, largest deflection {largest[name]:.2f} um")
assert largest["aluminium"] > largest["steel"] and largest["glass"] > largest["steel"]

# %% [markdown]
# ## Error and time
# A study runs every combination of the values and is one table: here the error of the deflection over time against
# Timoshenko's beam, for three cells, and the CPU time of stepping.

# %%
table = tandem.study(
    tandem.Scene("singer2022/beam_single", values={"time.end": 0.00036}),
    {"variant": ["cell_5mm", "paper_cell", "plain"]},
    "runs/beam-cells",
    options=["--error", "deflection over time", "--repeat", "1"],
)
table[["variant", "status", "error", "stepping cpu", "steps", "points"]]

# %%
assert set(table["status"]) <= {"done", "check_failed"}, table["reason"]
table.plot("stepping cpu", "error", style="o", loglog=True, xlabel="CPU time of stepping [s]", ylabel="error", legend=False)
