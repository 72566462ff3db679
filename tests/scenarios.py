"""One strategy for all that any valid scenario has to do: `scenarios()`."""

from typing import Any

from hypothesis import strategies as st

Data = dict[str, Any]


def decades(low: int, high: int) -> st.SearchStrategy[float]:
    return st.floats(10.0**low, 10.0**high)


FRACTION = st.floats(0, 1)
ANGLE = st.floats(-1.5, 1.5).map(lambda angle: f"{angle!r} rad")
LIGHTER = st.floats(-1, 1, exclude_min=True, exclude_max=True)
PARTS = st.lists(st.sampled_from(["soil", "joints"]), min_size=1, unique=True)
FRICTIONS = st.one_of(
    st.floats(0, 5),
    st.floats(0, 89).map(lambda angle: f"{angle!r} deg"),
    st.tuples(st.floats(0, 5), FRACTION, decades(-6, 2)).map(
        lambda v: {"static": v[0], "kinetic": v[0] * v[1], "transition_speed": v[2]}
    ),
)
DEPTH = st.floats(-5.0, 0.0)
PROFILES = st.lists(DEPTH, min_size=2, max_size=4).map(lambda heights: [[100.0 * x, y] for x, y in enumerate(heights)])
WALLS = st.tuples(DEPTH, DEPTH).map(lambda y: {"from": [1e4, y[0]], "to": [1e4 + 1, y[1]], "material": "m"})
PAIRS = st.dictionaries(
    st.sampled_from(["restitution", "shear_stiffness_ratio", "shear_damping_ratio"]), st.floats(0.1, 1)
).flatmap(lambda table: FRICTIONS.map(lambda friction: {**table, "friction": friction}))
TEXT = st.text(st.characters(exclude_categories=["Cs"]), max_size=30)
MATERIALS = st.fixed_dictionaries({"young_modulus": decades(6, 12), "poisson_ratio": st.floats(-0.99, 0.49)}).flatmap(
    lambda table: st.tuples(st.sampled_from(["density", "unit_weight"]), decades(3, 4)).map(
        lambda chosen: {**table, chosen[0]: chosen[1]}
    )
)
BLOCK = {"width": 0.2, "height": 0.1, "length": 0.1, "material": "m"}
STONE = {"depth": 0.1, "material": "m"}
MOVING: Data = {
    "velocity": st.lists(st.floats(-2, 2), min_size=2, max_size=2),
    "shear_velocity": st.floats(-1, 1),
    "left": st.floats(-3, 3),
    "bottom": st.floats(0, 20),
}
GAP, LIFTED, SEED = st.floats(0.004, 0.1), st.floats(1, 20), st.integers(0, 2**32 - 1)
TURN = st.floats(0, 3).map(lambda angle: f"{angle!r} rad")


def structure(kind: str, block: str = "b", **keys: Any) -> st.SearchStrategy[Data]:
    needed = {name: key if isinstance(key, st.SearchStrategy) else st.just(key) for name, key in keys.items()}
    moving = {name: key for name, key in MOVING.items() if name not in needed}
    return st.fixed_dictionaries({"kind": st.just(kind), "block": st.just(block), **needed}, optional=moving)


STRUCTURES = st.one_of(
    structure("stack", count=2, offset=st.floats(-0.05, 0.05)),
    structure("staircase", count=3, overlap=st.floats(0.05, 0.2)),
    structure("wall", rows=2, columns=2, gap=GAP, bond="stack", holes=[[1, 2]]),
    structure("wall", rows=3, columns=2, gap=GAP, offset=st.floats(0, 0.001), missing=0.3, seed=SEED),
    structure("pyramid", rows=2, gap=GAP),
    structure("dominoes", count=3, spacing=GAP, push=st.floats(-0.5, 0.5)),
    structure("grid", rows=2, columns=2, gap_x=0.3, gap_y=0.4, offset=GAP, turn=TURN, seed=SEED, bottom=LIFTED),
    structure("arch", "s", radius=st.floats(1, 3), thickness=st.floats(0.2, 0.9), count=5),
    structure("column", "s", count=3, height=2, width=st.floats(0.2, 1), top_width=st.floats(0.2, 1)),
    structure("voronoi", "s", count=5, width=2, height=1, seed=SEED),
    structure("polygons", "s", cells=[{"outline": [[0, 0], [1, 0], [0, 1]], "name": "a", "fixed": True}]),
)
SPRINGS = {
    "stiffness_scale": decades(-4, 0),
    "normal_stiffness": decades(4, 8),
    "shear_damping_ratio": st.floats(0, 3),
    "max_overlap": decades(-2, 0),
}
TIME = {"end": decades(-3, 2), "rest_hold": FRACTION}
SCHEMES: st.SearchStrategy[Data] = st.one_of(
    st.fixed_dictionaries(
        {"time": st.fixed_dictionaries({"scheme": st.just("explicit"), "safety": st.floats(0.01, 0.1), **TIME})},
        optional={"contact": st.fixed_dictionaries({}, optional={"restitution": FRACTION, **SPRINGS})},
    ),
    st.fixed_dictionaries(
        {"time": st.fixed_dictionaries({"scheme": st.just("nonsmooth"), "substeps": st.integers(1, 4), **TIME})},
        optional={"contact": st.fixed_dictionaries({"restitution": FRACTION})},
    ),
)


def scenarios() -> st.SearchStrategy[Data]:
    """Draw the data of any valid scenario of a structure and a body far above it, which a computer runs in a moment."""
    tables = st.fixed_dictionaries(
        {
            "schema": st.just(1),
            "name": st.from_regex(r"[A-Za-z0-9_][A-Za-z0-9._-]{0,20}[A-Za-z0-9_-]", fullmatch=True),
            "materials": st.fixed_dictionaries({"m": MATERIALS}),
            "blocks": st.sampled_from(["width", "height", "length"]).map(
                lambda upright: {"b": BLOCK, "s": STONE, "t": {**BLOCK, "upright": upright}}
            ),
            "structures": st.lists(STRUCTURES, min_size=1, max_size=1),
            "bodies": st.fixed_dictionaries(
                {"x": st.floats(-1e3, 1e3), "y": st.floats(50, 1e3), "angle": ANGLE, "spin": st.floats(-1e3, 1e3)},
                optional={"velocity": st.lists(st.floats(-1e3, 1e3), min_size=2, max_size=2)},
            ).map(lambda table: [{**table, "block": "t"}]),
        },
        optional={
            "description": TEXT,
            "gravity": st.floats(0, 100)
            | st.fixed_dictionaries(
                {}, optional={"magnitude": st.floats(0, 100), "horizontal": st.floats(-2, 2), "vertical": LIGHTER}
            ),
            "strength": st.fixed_dictionaries({}, optional={"factor": st.floats(0.1, 10), "of": PARTS}),
            "ground": st.fixed_dictionaries({"tilt": ANGLE}, optional={"profile": PROFILES}),
            "walls": st.lists(WALLS, max_size=2),
            "pairs": st.fixed_dictionaries(
                {}, optional={"m": st.fixed_dictionaries({}, optional={"m": PAIRS, "ground": PAIRS}).filter(bool)}
            ),
            "friction": st.fixed_dictionaries({}, optional={"block_block": FRICTIONS, "block_ground": FRICTIONS}),
            "provenance": st.fixed_dictionaries({"time.end": TEXT}),
        },
    )
    return st.builds(lambda data, scheme: {**data, **scheme}, tables, SCHEMES)
