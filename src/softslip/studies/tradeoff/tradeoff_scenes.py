"""The scenes of the trade-off: packings aged, sheared and settled once, then given to all members.

A dataset holds them all. Their membranes lie one after the other along ``particle`` and ``node``;
``particles`` says how many each has.
"""

from dataclasses import replace

import numpy as np
import xarray as xr

from softslip.config.parameters import Parameters
from softslip.files.quantities import described
from softslip.solver.geometry import FloatArray
from softslip.studies import scenes
from softslip.studies.boxes import merged
from softslip.studies.meanings import attributes
from softslip.studies.membrane_nodes import renoded
from softslip.studies.timing import Tell, silent
from softslip.studies.tradeoff.members import LEVEL, Member, finest_member, parameters_of
from softslip.studies.tradeoff.tradeoff_design import TradeoffDesign

PER_PARTICLE, PER_SCENE = ("nodes_per_particle", "reference_area"), ("wall_displacement",)
"""Variables along ``particle`` and along ``scene``."""


def prepare(design: TradeoffDesign, tell: Tell = silent) -> xr.Dataset:
    """Return the membranes of every scene, flowing and at rest on the closest nodes.

    Packings are grown and aged at `LEVEL`, sheared there for ``design.shearing``, then for
    ``design.settling`` on the closest nodes of the design at the mesh's regularisation length.

    Raises
    ------
    SoftslipError
        When there is no such packing, or a run fails.
    """
    found = []
    for roughness in design.roughnesses:
        tell(f"ageing {design.particles} particles at roughness {roughness:g}")
        aged = aged_packing(Member("start", "level", LEVEL), design, roughness)
        for stress in design.stresses:
            tell(f"shearing at roughness {roughness:g} and stress {stress:g}")
            found.append(_flowing(aged, design, stress, roughness))
    places = [(stress, roughness) for roughness in design.roughnesses for stress in design.stresses]
    stresses, roughnesses = map(list, zip(*places, strict=True))
    return _joined(found).assign_coords(
        stress=("scene", stresses, attributes("stress unit", "imposed stress")),
        roughness=("scene", roughnesses, attributes("1", "wall roughness")),
    )


def aged_packing(
    member: Member,
    design: TradeoffDesign,
    roughness: float,
    *,
    seed: int | None = None,
    ageing: float | None = None,
) -> xr.Dataset:
    """Return an aged packing of the design with a member's settings, see `scenes.aged_packing`."""
    # What is imposed has no effect on ageing.
    given = parameters_of(member, design, design.stresses[0], roughness, seed=seed)
    timing = {"ageing_time": design.ageing if ageing is None else ageing}
    timed = merged(given.model_dump(), {"time_stepping": timing})
    return scenes.aged_packing(Parameters.from_mapping(timed))


def scene_of(dataset: xr.Dataset, stress: float, roughness: float) -> xr.Dataset:
    """Return the membranes of one scene, with its ``wall_displacement``.

    Raises
    ------
    KeyError
        When the dataset has no such scene.
    """
    here = (dataset["stress"].values == stress) & (dataset["roughness"].values == roughness)
    if not here.any():
        raise KeyError(f"no scene at stress {stress:g} and roughness {roughness:g}")
    number = int(np.flatnonzero(here)[0])
    particles = np.append(0, np.cumsum(dataset["particles"].values))
    nodes = np.append(0, np.cumsum(dataset["nodes_per_particle"].values))
    first, last = particles[number], particles[number + 1]
    return dataset.isel(
        scene=number, particle=slice(first, last), node=slice(nodes[first], nodes[last])
    )


def on_member(scene: xr.Dataset, parameters: Parameters, displacement: float = 0.0) -> scenes.Scene:
    """Return a scene on the nodes of a member's parameters.

    Parameters
    ----------
    scene
        Of `scene_of`.
    parameters
        Of the member's run.
    displacement
        Size of a fixed random displacement of each coordinate of every node [length unit].

    Raises
    ------
    NumericalError
        When no tethers are found that hold the walls.
    """
    membranes = renoded(scene, parameters)
    if displacement:
        random = np.random.default_rng(np.random.SeedSequence(parameters.seed))
        moved = membranes["node_position"].values
        moved += displacement * random.standard_normal(moved.shape)
    return scenes.scene_of(membranes, parameters, scene["wall_displacement"].values)


def _flowing(
    aged: xr.Dataset, design: TradeoffDesign, stress: float, roughness: float
) -> xr.Dataset:
    """Return a packing after its time under stress, on the closest nodes."""
    membranes, walls = aged, aged["wall_displacement"].values
    steps = (
        (Member("start", "level", LEVEL), design.shearing),
        (finest_member(design, None), design.settling),
    )
    for member, duration in steps:
        parameters = parameters_of(member, design, stress, roughness)
        scene = scenes.scene_of(renoded(membranes, parameters), parameters, walls)
        scene = replace(scene, state=scenes.advance(scene, duration).state)
        membranes, walls = scenes.membranes_of(scene), scene.state.wall_displacement
    return membranes.assign(wall_displacement=("wall", np.array(walls, dtype=np.float64)))


def _joined(found: list[xr.Dataset]) -> xr.Dataset:
    """Return scenes one after the other."""

    def along(name: str) -> FloatArray:
        return np.concatenate([each[name].values for each in found])

    return described(
        xr.Dataset(
            {
                "node_position": (("node", "axis"), along("node_position")),
                **{name: ("particle", along(name)) for name in PER_PARTICLE},
                **{
                    name: (("scene", "wall"), np.stack([each[name].values for each in found]))
                    for name in PER_SCENE
                },
                "particles": (
                    "scene",
                    [each.sizes["particle"] for each in found],
                    attributes("1", "number of particles of each scene"),
                ),
            }
        )
    )
