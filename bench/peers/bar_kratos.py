"""The bar with Kratos' explicit MPM: bilinear shape functions, MUSL, plane strain, f64. Every element of the body's mesh holds
one point, so that points lie as in the other codes. (Its central differences and its USF swing at sqrt(2) times the frequency
here, with velocities that are given to the points; USL and MUSL do not.)"""

import json
import os
import sys
import tempfile

import bar_common
import numpy as np

threads = int(sys.argv[1])
b = bar_common.bar()
h = b["length"] / b["cells"]
side = round(b["per_cell"] ** 0.5)
columns, rows = b["cells"], round(b["height"] / h)
room = 2


def mesh(path, element, lower, cell, count, first):
    """An mdpa file of `count` quadrilaterals of a size; points and elements are numbered from `first`."""
    across, up = count
    with open(path, "w", encoding="utf-8") as file:
        file.write("Begin Properties 0\nEnd Properties\nBegin Nodes\n")
        for i in range(across + 1):
            for j in range(up + 1):
                file.write(f"{first + i * (up + 1) + j} {lower[0] + i * cell!r} {lower[1] + j * cell!r} 0.0\n")
        file.write(f"End Nodes\nBegin Elements {element}\n")
        for i in range(across):
            for j in range(up):
                a = first + i * (up + 1) + j
                file.write(f"{first + i * up + j} 0 {a} {a + up + 1} {a + up + 2} {a + 1}\n")
        file.write("End Elements\n")
        if element.startswith("MPM"):
            file.write("Begin SubModelPart bar\nBegin SubModelPartNodes\n")
            file.writelines(f"{first + k}\n" for k in range((across + 1) * (up + 1)))
            file.write("End SubModelPartNodes\nBegin SubModelPartElements\n")
            file.writelines(f"{first + k}\n" for k in range(across * up))
            file.write("End SubModelPartElements\nEnd SubModelPart\n")


scratch = tempfile.mkdtemp()
os.chdir(scratch)
nodes = (columns + 2 * room + 1) * (rows + 2 * room + 1)
mesh("grid.mdpa", "Element2D4N", (-room * h, -room * h), h, (columns + 2 * room, rows + 2 * room), 1)
mesh("body.mdpa", "MPMUpdatedLagrangian2D4N", (0.0, 0.0), h / side, (columns * side, rows * side), nodes + 1)
law = {"name": "LinearElasticIsotropicPlaneStrain2DLaw"}
variables = {"THICKNESS": 1.0, "MATERIAL_POINTS_PER_ELEMENT": 1, "DENSITY": b["density"], "YOUNG_MODULUS": b["young"], "POISSON_RATIO": 0.0}
material = {"model_part_name": "Initial_MPM_Material.bar", "properties_id": 1,
            "Material": {"constitutive_law": law, "Variables": variables, "Tables": {}}}
with open("materials.json", "w", encoding="utf-8") as file:
    json.dump({"properties": [material]}, file)
project = {
    "problem_data": {"problem_name": "bar", "parallel_type": "OpenMP", "echo_level": 0, "start_time": 0.0, "end_time": 1.0},
    "solver_settings": {
        "solver_type": "Dynamic", "time_integration_method": "explicit", "scheme_type": "forward_euler", "stress_update": "musl",
        "model_part_name": "MPM_Material", "domain_size": 2, "echo_level": 0, "analysis_type": "linear",
        "model_import_settings": {"input_type": "mdpa", "input_filename": "body"},
        "grid_model_import_settings": {"input_type": "mdpa", "input_filename": "grid"},
        "material_import_settings": {"materials_filename": "materials.json"},
        "time_stepping": {"time_step": b["step"]}, "pressure_dofs": False, "auxiliary_variables_list": [],
    },
    "processes": {}, "output_processes": {},
}

import KratosMultiphysics as Kratos  # noqa: E402
import KratosMultiphysics.MPMApplication as MPM  # noqa: E402
from KratosMultiphysics.MPMApplication.mpm_analysis import MpmAnalysis  # noqa: E402

Kratos.Logger.GetDefaultOutput().SetSeverity(Kratos.Logger.Severity.WARNING)
Kratos.ParallelUtilities.SetNumThreads(threads)
analysis = MpmAnalysis(Kratos.Model(), Kratos.Parameters(json.dumps(project)))
analysis.Initialize()
part = analysis.model["MPM_Material"]
info = part.ProcessInfo
elements = list(part.Elements)
where = np.array([element.CalculateOnIntegrationPoints(MPM.MP_COORD, info)[0] for element in elements])[:, :2]
position, velocity, _ = bar_common.points(b)
# Points of the other codes in the order of these.
key = lambda places: np.lexsort((np.round(places[:, 1] / h * 1e3), np.round(places[:, 0] / h * 1e3)))
order, own = key(position), key(where)
assert np.abs(position[order] - where[own]).max() < 1e-9 * b["length"], "the points lie elsewhere"
for k, e in zip(order, own):
    elements[e].SetValuesOnIntegrationPoints(MPM.MP_VELOCITY, [[velocity[k, 0], velocity[k, 1], 0.0]], info)


def velocity_x():
    v = np.array([element.CalculateOnIntegrationPoints(MPM.MP_VELOCITY, info)[0][0] for element in elements])
    sorted_as_others = np.empty_like(v)
    sorted_as_others[order] = v[own]
    return sorted_as_others


def advance(steps):
    for _ in range(steps):
        analysis.time = analysis._AdvanceTime()
        analysis.InitializeSolutionStep()
        analysis._GetSolver().Predict()
        analysis._GetSolver().SolveSolutionStep()
        analysis.FinalizeSolutionStep()


bar_common.run("Kratos MPM", threads, advance, velocity_x, lambda: None)
