import math

import numpy as np
import pytest
import scenes

from softslip.errors import ExpansionError
from softslip.simulation import expansion as module
from softslip.simulation.contour import check_contours, signed_areas, split
from softslip.simulation.packing import pack


def crowd(**groups):
    """Parameters of some two dozen particles at the mesh of the demo."""
    groups.setdefault("packing", {"equilibration_steps": 500})
    groups.setdefault("hydrodynamics", {"resolution": 4096})
    return scenes.parameters(**groups)


@pytest.fixture(scope="module", params=[0.0, 0.59])
def grown(request):
    parameters = crowd(wall={"roughness": request.param})
    return parameters, module.expand(pack(parameters), parameters)


@pytest.fixture(scope="module")
def packed():
    return pack(crowd())


def offsets_of(dataset):
    return np.append(0, np.cumsum(dataset["nodes_per_particle"].values))


def membranes(dataset):
    return list(split(dataset["node_position"].values, offsets_of(dataset)))


def test_every_area_is_on_target_and_so_is_the_area_fraction(grown):
    parameters, dataset = grown
    areas = signed_areas(dataset["node_position"].values, offsets_of(dataset))
    error = np.abs(areas / dataset["target_area"].values - 1).max()
    assert error < 1e-12, f"an area is off by {error:.2g}"
    fraction = areas.sum() / (parameters.channel.length * parameters.channel.height)
    assert fraction == pytest.approx(0.84, rel=1e-12)
    assert dataset.attrs["area_fraction"] == pytest.approx(fraction, rel=1e-12)
    np.testing.assert_allclose(dataset["area"], areas, rtol=1e-12)


def test_membranes_are_farther_apart_than_the_shear_stage_needs(grown):
    parameters, dataset = grown
    nodes, length = membranes(dataset), parameters.channel.length
    smallest = math.inf
    for p, first in enumerate(nodes):
        for second in nodes[:p]:
            delta = first[:, None] - second[None]
            delta[..., 0] -= length * np.round(delta[..., 0] / length)
            smallest = min(smallest, float(np.hypot(delta[..., 0], delta[..., 1]).min()))
    ratio = dataset.attrs["smallest_distance"] / parameters.steric.length
    assert ratio >= 0.6, f"two bodies are {ratio:.2g} contact ranges apart"
    assert dataset.attrs["smallest_distance"] <= smallest * (1 + 1e-12)


def test_contacts_begin_within_the_range_of_the_shear_stage(grown):
    parameters, dataset = grown
    ratio = dataset.attrs["smallest_distance"] / parameters.steric.length
    assert ratio < 1, f"a jammed packing is {ratio:.2g} contact ranges apart"


def test_nodes_are_equally_spaced_and_contiguous(grown):
    parameters, dataset = grown
    wanted = parameters.hydrodynamics.node_spacing / parameters.hydrodynamics.resolution
    for nodes in membranes(dataset):
        spacing = np.hypot(*(np.roll(nodes, -1, axis=0) - nodes).T)
        uneven = np.ptp(spacing) / spacing.mean()
        assert uneven < 0.02, f"the spacing varies by {uneven:.2g}"
        # A deformed membrane is longer than the circle on which the spacing is defined.
        assert 0.98 < spacing.mean() / wanted < 1.15


def test_centroids_lie_in_the_first_period(grown):
    parameters, dataset = grown
    x = np.array([module.centroid(nodes)[0] for nodes in membranes(dataset)])
    assert x.min() >= 0
    assert x.max() < parameters.channel.length


def test_crowded_particles_deform(grown):
    _, dataset = grown
    excess = np.array(
        [
            np.hypot(*(np.roll(nodes, -1, axis=0) - nodes).T).sum() / math.sqrt(4 * math.pi * area)
            - 1
            for nodes, area in zip(membranes(dataset), dataset["area"].values, strict=True)
        ]
    )
    assert 0.005 < excess.mean() < 0.05, f"perimeters exceed the circle's by {excess.mean():.2g}"


def test_result_passes_the_exact_checks(grown):
    parameters, dataset = grown
    report = check_contours(
        dataset["node_position"].values,
        offsets_of(dataset),
        dataset["target_area"].values,
        parameters,
    )
    assert report.smallest_distance == dataset.attrs["smallest_distance"]


def test_same_input_gives_the_same_bytes(packed):
    first, second = (module.expand(packed, crowd()) for _ in range(2))
    assert first["node_position"].values.tobytes() == second["node_position"].values.tobytes()


def test_shapes_do_not_depend_on_the_mesh(packed):
    coarse, fine = (
        module.expand(packed, crowd(hydrodynamics={"resolution": resolution}))
        for resolution in (4096, 8192)
    )
    apart = [
        np.abs(module.centroid(a) - module.centroid(b)).max()
        for a, b in zip(membranes(coarse), membranes(fine), strict=True)
    ]
    assert max(apart) < 1e-6, f"a particle sits {max(apart):.2g} elsewhere"


def test_paper_puts_250_nodes_on_a_small_particle():
    parameters = crowd(
        channel={"length": 0.5, "height": 0.4375}, hydrodynamics={"resolution": 8192}
    )
    counts = module.membrane_node_counts(parameters)
    assert abs(counts.min() - 250) <= 6, f"there are {counts.min()}"
    assert abs(counts.max() - 350) <= 8, f"there are {counts.max()}"


def test_no_membrane_has_fewer_nodes_than_resolve_it():
    coarse = crowd(hydrodynamics={"resolution": 256, "node_spacing": 4.0}, steric={"length": 0.025})
    assert module.membrane_node_counts(coarse).min() == module.FEWEST_NODES


def test_progress_rises_to_one(packed):
    seen = []
    module.expand(packed, crowd(), progress=seen.append)
    assert np.all(np.diff(seen) > 0)
    assert 0 < seen[0] < 0.2
    assert seen[-1] == 1.0


def test_no_particles_make_an_empty_dataset():
    nothing = scenes.empty()
    dataset = module.expand(pack(nothing), nothing)
    assert dataset["node_position"].shape == (0, 2)
    assert dataset["nodes_per_particle"].shape == (0,)
    assert dataset.attrs["area_fraction"] == 0


@pytest.mark.parametrize("fraction", [0.03, 0.3])
def test_dilute_particles_stay_round(fraction):
    dilute = crowd(suspension={"area_fraction": fraction})
    dataset = module.expand(pack(dilute), dilute)
    assert (dataset.sizes["particle"] == 1) == (fraction == 0.03)
    for nodes in membranes(dataset):
        radius = np.hypot(*(nodes - module.centroid(nodes)).T)
        assert np.ptp(radius) / radius.mean() < 1e-3


@pytest.mark.parametrize("roughness", [0.05, 1.5])
def test_other_roughness_grows_as_well(roughness):
    parameters = crowd(wall={"roughness": roughness}, suspension={"area_fraction": 0.8})
    dataset = module.expand(pack(parameters), parameters)
    assert dataset.attrs["area_fraction"] == pytest.approx(0.8, rel=1e-12)


def test_particles_that_cannot_fit_are_an_error():
    full = crowd(suspension={"area_fraction": 0.95})
    with pytest.raises(ExpansionError, match=r"no room to grow: a gap shrank .* lower"):
        module.expand(pack(full), full)


def test_membranes_that_end_too_close_are_an_error(packed):
    strict = crowd(expansion={"closest_approach": 0.95})
    with pytest.raises(ExpansionError, match=r"two bodies are only .* apart, closer than"):
        module.expand(packed, strict)


def test_growth_too_fast_to_stay_apart_is_an_error(packed):
    rushed = crowd(expansion={"ramp_steps": 1, "relaxation_steps": 0})
    with pytest.raises(ExpansionError):
        module.expand(packed, rushed)


def test_a_packing_of_other_parameters_is_refused(packed):
    other = crowd(suspension={"area_fraction": 0.5})
    with pytest.raises(ExpansionError, match=r"holds \d+ discs, but the parameters make \d+"):
        module.expand(packed, other)
