"""The quantities of datasets: the unit and the meaning of each name, once.

Schemas and datasets refer to this table. Parameters of a run have theirs in `config`. No quantity
has a standard name of CF: those are of quantities in SI units, and nothing here has any. How files
spell units is up to `files.conventions`.
"""

from collections.abc import Mapping
from typing import NamedTuple

import xarray as xr

LENGTH, TIME, STRESS, RATE = "length unit", "time unit", "stress unit", "1 / time unit"
SPEED, AREA = "length unit / time unit", "length unit squared"
SLIP = "length unit / time unit / stress unit"


class DatasetQuantity(NamedTuple):
    """Unit and meaning of a quantity; what labels a dimension by words has an empty unit."""

    unit: str
    meaning: str

    @property
    def attributes(self) -> dict[str, str]:
        """The attributes of a variable of this quantity."""
        return ({"units": self.unit} if self.unit else {}) | {"long_name": self.meaning}


QUANTITIES: Mapping[str, DatasetQuantity] = {
    name: DatasetQuantity(unit, meaning)
    for name, unit, meaning in (
        ("axis", "", "component of a vector"),
        ("wall", "", "wall of the channel"),
        # Packing and expansion.
        ("centre", LENGTH, "disc centre in the channel frame"),
        ("radius", LENGTH, "disc radius in the packing"),
        ("final_radius", LENGTH, "radius of a disc of the particle's final area"),
        ("nodes_per_particle", "1", "number of nodes of each membrane"),
        ("area", AREA, "area of the polygon of each membrane"),
        ("target_area", AREA, "area that each membrane was grown to"),
        # States.
        ("node_position", LENGTH, "position of nodes, membrane by membrane, then the walls'"),
        ("tether", STRESS, "tractions that hold the wall nodes"),
        ("wall_displacement", LENGTH, "displacement of each wall along x since ageing began"),
        ("reference_area", AREA, "area that each particle keeps"),
        # Records.
        ("time", TIME, "time since the stage began, at the end of the record's interval"),
        ("interval", TIME, "length of the interval that a record is the mean of"),
        ("wall_velocity", SPEED, "velocity of each wall along x"),
        ("shear_rate_wall", RATE, "apparent shear rate, relative wall speed over H"),
        ("shear_rate_bulk", RATE, "true shear rate, slope of the mean velocity profile"),
        ("slip_velocity", SPEED, "slip velocity, mean of both walls"),
        ("slip_velocity_wall", SPEED, "slip velocity at each wall"),
        ("traction", STRESS, "mean traction on the upper wall"),
        ("stress", STRESS, "shear stress that the packing carries"),
        ("stress_deviation", STRESS, "largest deviation of the x-averaged stress in the gap"),
        ("area_deviation", "1", "largest relative change of any particle's area"),
        ("film_thickness", LENGTH, "smallest distance between nodes of two bodies"),
        ("strain", "1", "relative wall displacement over H since ageing began"),
        # Profiles and snapshots.
        ("velocity_profile", SPEED, "x-averaged velocity along x"),
        ("wall_distance", LENGTH, "height above the flat part of the lower wall"),
        ("profile_time", TIME, "end of the interval that a profile is the mean of"),
        ("snapshot_time", TIME, "time of the snapshot since the stage began"),
        ("velocity", SPEED, "fluid velocity"),
        ("field_x", LENGTH, "position along the flow"),
        ("field_y", LENGTH, "height above the flat part of the lower wall"),
        ("non_affine_velocity", "1", "non-affine velocity over the bulk shear rate and H"),
        # Runs in one dataset.
        ("status", "1", "whether a run is done"),
        ("run_id", "1", "run that it comes from"),
        ("runs", "1", "number of runs behind this"),
        ("runs_done", "1", "number of runs done"),
        # The flow curve.
        ("steady", "1", "whether a steady state was reached: wall and bulk"),
        ("steady_wall", "1", "whether a steady state was reached: apparent shear rate"),
        ("steady_bulk", "1", "whether a steady state was reached: true shear rate"),
        ("steady_slip", "1", "whether a steady state was reached: slip velocity"),
        ("drift", "1", "largest relative change over the window"),
        ("shear_stress", STRESS, "mean shear stress of the packing"),
        ("steady_from", TIME, "start of the window of the averages"),
        ("yielding_time", TIME, "time of the least bulk shear rate"),
        ("yielded", "1", "whether the bulk yielded"),
        ("slip_time", TIME, "time of half the steady slip velocity"),
        ("verdict_wall", "1", "verdict on the steady state: apparent shear rate"),
        ("verdict_bulk", "1", "verdict on the steady state: true shear rate"),
        ("verdict_slip", "1", "verdict on the steady state: slip velocity"),
        ("heterogeneity", "1", "heterogeneity of the bulk flow"),
        ("newtonian_slip_length", LENGTH, "thickness of the film of solvent at the wall"),
        ("total_slip_length", LENGTH, "slip velocity over the bulk shear rate"),
        (
            "master_curve_spread",
            "1",
            "spread of the bulk shear rate in time between roughnesses, over the rate",
        ),
        (
            "master_curve_expected_spread",
            "1",
            "spread of the bulk shear rate in time that scatter between seeds lets expect",
        ),
        (
            "master_curve_spread_ratio",
            "1",
            "spread of the bulk shear rate in time between roughnesses over the one expected",
        ),
        (
            "master_curve_spread_chance",
            "1",
            "chance of such a spread where roughness makes no difference",
        ),
        ("master_curves", "1", "number of roughnesses whose bulk shear rates are compared"),
        ("snapshots_used", "1", "number of snapshots averaged"),
        ("distance_from_wall", "1", "distance from the nearer wall over the mean radius"),
        (
            "particle_distance",
            "1",
            "distance of particles' centroids from the nearer wall over the mean radius",
        ),
        ("quantile", "1", "share of a wall along which the film is thinner"),
        ("deformation", "1", "stretch of particles, difference of semi-axes over their sum"),
        ("orientation", "degree", "angle of particles' long axis to the flow"),
        ("fluidity", "1 / time unit / stress unit", "local shear rate over the shear stress"),
        ("wall_film", "1", "distance from a wall to the nearest membrane over their repulsion's"),
        (
            "particle_stress",
            "stress unit",
            "local shear stress less the solvent's: that carried by particles",
        ),
        (
            "first_layer_gap",
            "1",
            "distance of the first layer's particles from the wall over their repulsion's",
        ),
        ("correlation_length", "1", "extent of the flow's fluctuations over the mean radius"),
        (
            "cooperativity_length",
            "1",
            "reach of the walls' effect on fluidity over the mean radius",
        ),
        ("structure_snapshots", "1", "number of snapshots in the steady window"),
        ("profiles_used", "1", "number of profiles averaged"),
        ("normalised_position", "1", "distance from the lower wall over the wall separation"),
        ("normalised_velocity", "1", "velocity from that of the lower to that of the upper wall"),
        # Laws.
        ("parameter", "", "parameter of the flow law"),
        ("other_parameter", "", "parameter of the flow law"),
        ("yield_stress", STRESS, "Herschel-Bulkley yield stress"),
        ("consistency", "stress unit * (time unit)^n", "Herschel-Bulkley consistency"),
        ("flow_index", "1", "Herschel-Bulkley flow index"),
        ("covariance", "products of the parameters' units", "covariance of the fit"),
        ("agreement", "1", "chance of such a difference between the yield stresses of each alone"),
        ("slip_coefficient", SLIP, "slip velocity over stress above yield"),
        ("newtonian_slip_coefficient", SLIP, "slip velocity over stress, below yield"),
        ("slip_exponent", "1", "exponent of the slip velocity in the stress above yield"),
        ("slip_yield_stress", STRESS, "stress at which slip above yield begins"),
        ("slip_linear_evidence", "1", "ln of the likelihood of slip's exponent 1 over that of 2"),
        ("critical_roughness", "1", "roughness at which the slip coefficient is halved"),
        ("heterogeneity_exponent", "1", "exponent of the heterogeneity in the stress"),
        ("yielding_exponent", "1", "exponent of the yielding time in the stress above yield"),
        ("slip_time_exponent", "1", "exponent of the slip time in the stress above yield"),
        ("separation_effect", "1", "relative change of the bulk shear rate with wall separation"),
        ("mooney_slip_velocity", SPEED, "slope of the apparent shear rate in 2/H (Eq. A1)"),
        (
            "mooney_slip_velocity_mismatch",
            "1",
            "Eq. A1's slip velocity less the profiles', over the error of the difference",
        ),
        ("mooney_shear_rate_bulk", RATE, "apparent shear rate for infinite H (Eq. A1)"),
        *(
            (
                f"{name}_{size}_trend",
                "1",
                f"relative change of the {quantity} with each doubling of the {words}",
            )
            for name, quantity in (
                ("shear_rate_bulk", "bulk shear rate"),
                ("slip_velocity", "slip velocity"),
            )
            for size, words in (("separation", "wall separation"), ("length", "channel length"))
        ),
        ("confidence", "1", "confidence of an interval"),
        ("end", "", "end of an interval"),
        ("reduced_chi_square", "1", "squared deviation over its error, by freedom"),
        ("points", "1", "number of points fitted"),
        ("fit_message", "1", "whether the law was fitted"),
    )
}
"""Every quantity of the chain and of the datasets over its runs, by its name there."""

FORMER_UNITS: Mapping[str, str] = {"length unit2": AREA}
"""Units as files from before this table spell them."""

POOLED = "pooled_"
"""Beginning of the names of what is fitted to all roughnesses together."""

JOINT = "joint_"
"""Beginning of the names of what is fitted to flow and slip together."""

_TOGETHER = {POOLED: "all roughnesses together", JOINT: "flow and slip together"}
"""What such beginnings of names mean."""

_DERIVED: Mapping[str, tuple[str, str]] = {
    "_drift_error": ("1", "uncertainty of the relative change over the window: "),
    "_drift": ("1", "relative change over the window: "),
    "_reported_error": ("", "uncertainty of the paper's: "),
    "_reported": ("", "the paper's: "),
    "_difference": ("1", "ours less the paper's, over the standard errors: "),
    "_remark": ("1", "why there is no number or no difference: "),
    "_freedom": ("1", "degrees of freedom of the uncertainty of: "),
    "_error": ("", "uncertainty of: "),
    "_smoothing": ("", "change with half or twice the smoothing of: "),
    "_interval": ("", "interval of confidence of: "),
    "_bracket": ("", "neighbours among the values swept that enclose: "),
    "_reduced_chi_square": ("1", "squared deviation over its error, by freedom: "),
    "_points": ("1", "number of points fitted: "),
    "_film": ("1", "whether a film of solvent was fitted beside it: "),
    "_message": ("1", "whether the law was fitted: "),
}
"""Ends of the names of what is known of a quantity, their units, and how their meanings begin.

Where the unit is empty, it is that of the quantity.
"""


def dataset_quantity(name: str) -> DatasetQuantity | None:
    """Return unit and meaning of a quantity, or of what is known of it, such as its ``_error``.

    Parameters
    ----------
    name
        Of a variable, also after `POOLED` or `JOINT`.

    Returns
    -------
    DatasetQuantity or None
        None where the table has no such quantity.
    """
    for prefix, words in _TOGETHER.items():
        if name.startswith(prefix):
            found = dataset_quantity(name.removeprefix(prefix))
            return found and DatasetQuantity(found.unit, f"{found.meaning}, {words}")
    if name in QUANTITIES:
        return QUANTITIES[name]
    for end, (unit, words) in _DERIVED.items():
        whole = QUANTITIES.get(name.removesuffix(end))
        if name.endswith(end) and whole is not None:
            return DatasetQuantity(unit or whole.unit, words + whole.meaning)
    return None


def unit_of(name: str) -> str:
    """Return the unit of a quantity, as `dataset_quantity`.

    Raises
    ------
    KeyError
        When there is no such quantity.
    """
    found = dataset_quantity(name)
    if found is None:
        raise KeyError(name)
    return found.unit


def described(dataset: xr.Dataset) -> xr.Dataset:
    """Return the dataset with unit and meaning at each of its variables that is a quantity."""
    for name, variable in dataset.variables.items():
        found = dataset_quantity(str(name))
        if found is not None:
            variable.attrs.update(found.attributes)
    return dataset
