"""The configuration of PROTOCOL.md section 10: which fields there are, of what kind, and what those are that are left out.

A field that has its default is not sent (clause J-2). `complete_dem` and `complete_mpm` fill in what is left out; the
session does so before `configure`, so a solver finds every field. `check_fields` refuses what is missing, mistyped or not
known here, such as the fields of capabilities that a solver has to name (`layers`, `interface`, `group_pairs`,
`contact_resolution`): one that
has them checks with a table of its own, `(DEM[0], {**DEM[1], "interface:text": "points"})`.
"""

import copy

from .control import Refusal


def _number(value):
    return isinstance(value, (int, float)) and not isinstance(value, bool)


# What a kind accepts, and how that is said.
_KINDS = {
    "any": (lambda value: True, "anything"),
    "number": (_number, "a number"),
    "count": (lambda value: isinstance(value, int) and not isinstance(value, bool) and value >= 1, "1 or more"),
    "flag": (lambda value: isinstance(value, bool), "true or false"),
    "text": (lambda value: isinstance(value, str), "a text"),
    "list": (lambda value: isinstance(value, list), "a list"),
    "pair": (lambda v: isinstance(v, list) and len(v) == 2 and all(map(_number, v)), "two numbers"),
}


def _numbers(first, *optional):
    """A law: its first number is always there, the others are 0 where they are left out."""
    return f"{first}:number", {f"{name}:number": 0.0 for name in optional}


# Fields that are always there, and the defaults of those that may be left out, each as `name:kind`.
LINEAR = _numbers("normal_stiffness", "tangential_stiffness", "friction", "damping_ratio", "damped_mass")
LAWS = {
    "linear": LINEAR,
    "granular": _numbers(
        "normal_stiffness",
        "tangential_stiffness",
        "friction",
        "damping_ratio",
        "damped_mass",
        "adhesion",
        "rolling_friction",
    ),
    "hertz_mindlin": _numbers("hertz_constant", "poisson_ratio", "friction", "restitution", "adhesion"),
    "area": _numbers("area_stiffness", "tangential_stiffness", "friction"),
}
LAWS["hertz_mindlin"][1]["restitution:number"] = 1.0
DEM = (
    "bodies:list skin:number",
    {
        "gravity:pair": [0.0, 0.0],
        "point_contact:any": {"linear": {"normal_stiffness": 0.0}},
        "body_contact:any": None,
        "overlap:text": "each_edge",
        "contact_pairs:list": [],
        "point_surfaces:list": [],
        "threads:count": 1,
    },
)
BODY = (
    "name:text shape:any inertia:any position:pair",
    {
        "sphero_radius:number": 0.0,
        "angle:number": 0.0,
        "velocity:pair": [0.0, 0.0],
        "spin:number": 0.0,
        "motion:any": "free",
        "surface:text": "",
    },
)
SHAPES = {"cluster": ("centers:list", {"radii:list": []})}
MOTIONS = {
    "guided": ("", {"hold_x:flag": False, "hold_y:flag": False, "hold_angle:flag": False}),
    "pushed": ("force:pair", {"torque:number": 0.0, "ramp:number": 0.0, "until:any": None}),
}
WALLS = ("", {"left:any": "open", "right:any": "open", "bottom:any": "open", "top:any": "open"})
FIELDS = ("", {"velocity:any": None, "stress:any": None})
FORCING = ("", {"body_force:any": None, "tractions:list": [], "holds:list": [], "stages:list": []})
HOLD = ("name:text group:any within:list", {"hold_x:flag": False, "hold_y:flag": False})
STAGE = ("from:number", {"damping:number": 0.0, "pic_fraction:any": None})
MPM = (
    "domain:list cell:number shape:any transfer:any materials:list groups:list skin:number",
    {
        "gravity:pair": [0.0, 0.0],
        "stress_update:text": "usf",
        "drift:text": "mapped",
        "plane:text": "strain",
        "walls:any": {},
        "contact_force:text": "point",
        "forcing:any": {},
        "constants:any": {},
        "leaving:text": "stop",
        "grid_contact:any": None,
        "probes:list": [],
        "threads:count": 1,
    },
)
GROUP = (
    "name:text material:any fill:any spacing:any",
    {
        "lattice:text": "grid",
        "velocity:pair": [0.0, 0.0],
        "fields:any": {},
        "contact_radius:any": None,
        "rigid:flag": False,
        "keeps_spin:flag": False,
    },
)


def _filled(table, fields):
    """`table` with the defaults of what it leaves out; anything but a table as it is, for `check_fields` to refuse."""
    if not isinstance(table, dict):
        return table
    return {**{field.split(":")[0]: copy.deepcopy(default) for field, default in fields[1].items()}, **table}


def _filled_choice(choice, members):
    """A choice with values, `{"linear": {...}}`, likewise."""
    if not isinstance(choice, dict):
        return choice
    return {name: _filled(values, members.get(name, ("", {}))) for name, values in choice.items()}


def _change(table, changes):
    """`table` with its fields changed by functions; lists element by element."""
    if isinstance(table, dict):
        for name, change in changes.items():
            value = table.get(name)
            if name in table:
                table[name] = [change(v) for v in value] if isinstance(value, list) else change(value)
    return table


def _law(law):
    return _filled_choice(law, LAWS)


def _body(body):
    changes = {"shape": lambda v: _filled_choice(v, SHAPES), "motion": lambda v: _filled_choice(v, MOTIONS)}
    return _change(_filled(body, BODY), changes)


def _group(group):
    return _change(_filled(group, GROUP), {"fields": lambda v: _filled(v, FIELDS)})


def _forcing(forcing):
    return _change(
        _filled(forcing, FORCING), {"holds": lambda v: _filled(v, HOLD), "stages": lambda v: _filled(v, STAGE)}
    )


def complete_dem(config):
    """A configuration of the bodies with the defaults of what it leaves out, at every level."""
    changes = {"bodies": _body, "point_contact": _law, "body_contact": _law}
    changes["contact_pairs"] = lambda pair: _change(pair, {"law": _law})
    return _change(_filled(config, DEM), changes)


def complete_mpm(config):
    """A configuration of the continuum with the defaults of what it leaves out, at every level."""
    changes = {"walls": lambda v: _filled(v, WALLS), "forcing": _forcing, "groups": _group}
    return _change(_filled(config, MPM), changes)


def check_fields(key, table, fields):
    """Refuses what is missing, of another kind, or would be overlooked (clauses S-5 and J-1)."""
    required, optional = ([field.split(":") for field in names] for names in (fields[0].split(), fields[1]))
    for name, kind in [*required, *(field for field in optional if field[0] in table)]:
        if name not in table:
            raise Refusal(f"{key}.{name}", "is missing")
        accepts, words = _KINDS[kind]
        if not accepts(table[name]):
            raise Refusal(f"{key}.{name}", f"is {table[name]!r}, expected {words}")
    known = [name for name, _ in [*required, *optional]]
    unknown = sorted(set(table) - set(known))
    if unknown:
        raise Refusal(key, f"unknown fields: {', '.join(unknown)}; known are: {', '.join(known)}")
