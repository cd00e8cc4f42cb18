"""The configuration of PROTOCOL.md section 10: which fields there are, and of what kind.

Every field is sent. `check_fields` refuses what is missing, mistyped or not known here.
"""

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

# The fields of each part, each as `name:kind`.
LINEAR = (
    "normal_stiffness:number tangential_stiffness:number friction:number damping_ratio:number damped_mass:number"
)
DEM = (
    "gravity:pair body:list contact:any body_contact:any overlap:text contact_pair:list point_surfaces:list"
    " group_pair:list contact_resolution:any interface:text skin:number threads:count"
)
BODY = (
    "name:text shape:any sphero_radius:number inertia:any position:pair angle:number velocity:pair spin:number"
    " motion:any surface:text"
)
MPM = (
    "domain:list cell:number gravity:pair shape:any transfer:any stress_update:text plane:text walls:any"
    " material:list points:list contact_force:text forcing:any constants:any leaving:text grid_contact:any layers:flag"
    " group_pair:list interface:text chain:list skin:number probe:list threads:count"
)
GROUP = (
    "name:text material:any fill:any spacing:any lattice:text velocity:pair fields:any contact_radius:any"
    " keeps_spin:flag"
)


def check_fields(key, table, fields):
    """Refuses what is missing, of another kind, or would be overlooked (clauses S-5 and J-1)."""
    known = dict(field.split(":") for field in fields.split())
    for name, kind in known.items():
        if name not in table:
            raise Refusal(f"{key}.{name}", "is missing")
        accepts, words = _KINDS[kind]
        if not accepts(table[name]):
            raise Refusal(f"{key}.{name}", f"is {table[name]!r}, expected {words}")
    unknown = sorted(set(table) - set(known))
    if unknown:
        raise Refusal(key, f"unknown fields: {', '.join(unknown)}; known are: {', '.join(known)}")
