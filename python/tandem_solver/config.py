"""The configuration of PROTOCOL.md section 10: which fields there are, and of what kind."""

from .control import Refusal


def _number(value):
    return isinstance(value, (int, float)) and not isinstance(value, bool)


# What a kind accepts, and how that is said.
_KINDS = {
    "any": (lambda value: True, "anything"),
    "number": (_number, "a number"),
    "count": (lambda value: isinstance(value, int) and not isinstance(value, bool) and value >= 1, "1 or more"),
    "text": (lambda value: isinstance(value, str), "a text"),
    "list": (lambda value: isinstance(value, list), "a list"),
    "pair": (lambda v: isinstance(v, list) and len(v) == 2 and all(map(_number, v)), "two numbers"),
}

# Fields that are always there, and those that may be left out, each as `name:kind`.
DEM = (
    "gravity:pair bodies:list point_contact:any body_contact:any skin:number threads:count",
    "overlap:text contact_pairs:list point_surfaces:list",
)
BODY = (
    "name:text shape:any sphero_radius:number inertia:any position:pair angle:number velocity:pair spin:number motion:any",
    "surface:text",
)
LINEAR = ("normal_stiffness:number", "tangential_stiffness:number friction:number damping_ratio:number")
MPM = (
    "domain:list cell:number gravity:pair shape:any transfer:any stress_update:text plane:text walls:any "
    "materials:list groups:list skin:number threads:count",
    "drift:text contact_force:text forcing:any constants:any leaving:text grid_contact:any",
)


def check_fields(key, table, fields):
    """Refuses what is missing, of another kind, or would be overlooked (clauses S-5 and J-1)."""
    required, optional = ([field.split(":") for field in names.split()] for names in fields)
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
