"""
The extension module.
"""

from _typeshed import SupportsGetItem, SupportsLenAndGetItem
from collections.abc import Callable, Mapping, Sequence
from numpy import bool_, float64
from numpy.typing import ArrayLike, NDArray
from os import PathLike
from truegrind._results import Poses, Solutions
from typing import Any, Final, Literal, SupportsFloat, SupportsIndex, final

__all__ = ["__version__", "Acceptance", "Arm", "Compensation", "Dataset", "Deviation", "Diagnosis", "Export", "Identification", "Model", "Plan", "Robot", "Simulation", "Toolpath", "Track", "accept", "cell_file", "compensate", "deviation", "diagnose", "forward", "identify", "inverse", "path", "plan", "robots", "simulate", "track"]

__version__: Final[str]

@final
class Acceptance:
    """
    Result of an acceptance test.
    """
    def __repr__(self, /) -> str: ...
    def _repr_html_(self, /) -> str: ...
    @property
    def accepted(self, /) -> bool:
        """
        Whether the arm is accepted: the decision is ``"accepted"``, and nothing of the report speaks against it.
        """
    @property
    def decision(self, /) -> Literal["accepted", "refused", "undecided", "not-evaluated"]:
        """
        ``accepted``, ``refused``, ``undecided`` (the uncertainty does not allow either, or the poses show too little of the arm) or
        ``not-evaluated`` (too few poses, or nothing measured).
        """
    @property
    def errors(self, /) -> dict[str, NDArray[Any]]:
        """
        Errors of the model: row numbers ``row`` and errors ``error_mm``, each of shape (n,); distances, or signed lengths for a cable.
        """
    @property
    def max_mm(self, /) -> float:
        """
        Largest error of the model (mm): a distance, or the error of a length.
        """
    @property
    def nominal_rmse_mm(self, /) -> float:
        """
        RMS error of the data sheet, with the sensor registered to it in the same way (mm).
        """
    @property
    def poses(self, /) -> int:
        """
        Number of different poses that count.
        """
    @property
    def rmse_mm(self, /) -> float:
        """
        RMS error of the model (mm).
        """
    @property
    def table(self, /) -> dict[str, list[Any]]:
        """
        The table of rows, one list per column.
        """
    def to_html(self, /) -> str:
        """
        The report as HTML.
        """
    def to_json(self, /) -> str:
        """
        The full result as JSON text, schema ``truegrind.acceptance/1``: the bytes that ``truegrind accept --json`` writes.
        """
    @property
    def uncertainty_mm(self, /) -> float | None:
        """
        Expanded uncertainty of 95.45 % that was used (mm); ``None`` if it is unknown.
        """

@final
class Arm:
    """
    An arm without a data sheet: the actual arm of a simulation, or the nominal arm of a model.
    """
    def __repr__(self, /) -> str: ...
    def forward(self, /, q_deg: ArrayLike, *, payload_kg: SupportsFloat | SupportsIndex | None = None, payload_centre_mm: SupportsLenAndGetItem[SupportsFloat | SupportsIndex] | None = None, temperature_c: SupportsFloat | SupportsIndex | None = None, time_h: SupportsFloat | SupportsIndex | None = None) -> Poses:
        """
        Poses of the flange in the base for controller angles (°) of shape (N, 6) or (6,): ``Poses(position_mm, rotation)``.
        Payload mass (kg) and its centre on the flange (mm), temperature (°C) and hours since power-on matter only for arms with
        such effects.
        """
    def inverse(self, /, position_mm: ArrayLike, rotation: ArrayLike, near_deg: ArrayLike | None = None) -> Solutions:
        """
        Controller angles (°) that reach poses of the flange: ``Solutions(q_deg, reached, why)``.
        """
    @property
    def name(self, /) -> str:
        """
        Name of the arm.
        """
    def to_toml(self, /) -> str:
        """
        The file of the arm (TOML), as ``truegrind simulate --arm`` writes it.
        """

@final
class Compensation:
    """
    A corrected program.
    """
    def __repr__(self, /) -> str: ...
    def _repr_html_(self, /) -> str: ...
    @property
    def changed(self, /) -> bool:
        """
        Whether any byte changes.
        """
    @property
    def counts(self, /) -> dict[str, int]:
        """
        Number of motions by status: changed, flagged, refused, left.
        """
    @property
    def motions(self, /) -> list[dict[str, Any]]:
        """
        Status of each motion: dictionaries as in the JSON.
        """
    @property
    def notes(self, /) -> list[str]:
        """
        Notes on tools and work objects, and on unused entries of the cell file.
        """
    @property
    def programs(self, /) -> dict[str, bytes]:
        """
        The corrected files: bytes by name.
        """
    def save(self, /, path: str | PathLike[str]) -> None:
        """
        Writes the corrected files to a folder, or a single file to a path. Originals are never overwritten.
        """
    def to_html(self, /) -> str:
        """
        The report as HTML.
        """
    def to_json(self, /) -> str:
        """
        The full result as JSON text, schema ``truegrind.compensation/1``: the bytes that ``truegrind compensate --dry-run --json`` writes.
        """

@final
class Dataset:
    """
    Measured poses: logged joint angles and the readings of one sensor.
    """
    def __len__(self, /) -> int: ...
    def __repr__(self, /) -> str: ...
    @property
    def file(self, /) -> str:
        """
        File name as printed in reports.
        """
    @staticmethod
    def from_csv(source: str | PathLike[str] | bytes, *, name: str | None = None, allow_odd_units: bool = False) -> Dataset:
        """
        Reads a text table (separated by comma, semicolon or tab) from a path or from bytes.
        """
    @staticmethod
    def from_dataframe(frame: Any, *, name: str = "dataframe", allow_odd_units: bool = False) -> Dataset:
        """
        Rows from a data frame: anything with the interchange protocol ``__dataframe__`` (pandas, polars, pyarrow, …), or with named
        columns that NumPy can convert. Columns are named as in files: q1 to q6 (°), L or measured_x, measured_y, measured_z (mm)
        and so on; nulls are empty cells.
        """
    @staticmethod
    def from_numpy(q_deg: ArrayLike, *, length_mm: ArrayLike | None = None, position_mm: ArrayLike | None = None, quaternion_wxyz: ArrayLike | None = None, readout_mm: ArrayLike | None = None, time_h: ArrayLike | None = None, temperature_c: ArrayLike | None = None, payload_kg: ArrayLike | None = None, payload_centre_mm: ArrayLike | None = None, approach: ArrayLike | None = None, anchor: ArrayLike | None = None, session: SupportsGetItem[int, str | None] | None = None, station: SupportsGetItem[int, str | None] | None = None, name: str = "numpy", allow_odd_units: bool = False) -> Dataset:
        """
        Rows from arrays: logged controller angles (°) of shape (N, 6), and the readings of one sensor: ``length_mm`` (N,) of a
        cable, ``position_mm`` (N, 3) of a tracker, or with ``quaternion_wxyz`` (N, 4) a pose. Optional: Cartesian read-out of the
        controller ``readout_mm`` (N, 3), ``time_h``, ``temperature_c`` and ``payload_kg`` (N,), the payload's
        centre of mass in the flange frame ``payload_centre_mm`` (N, 3), at the flange by default, approach directions (N, 6) in
        −1, 0, 1, number of the cable outlet ``anchor`` (N,), labels ``session`` and
        ``station``, where tracker or camera stood. NaN means unknown.
        """
    @staticmethod
    def from_xlsx(source: str | PathLike[str] | bytes, *, sheet: str | None = None, name: str | None = None, allow_odd_units: bool = False) -> Dataset:
        """
        Reads a workbook from a path or from bytes; by default the first sheet with the needed columns.
        """
    @property
    def length_mm(self, /) -> NDArray[float64] | None:
        """
        Lengths of a cable (mm), shape (N,); ``None`` for another sensor.
        """
    @property
    def notes(self, /) -> list[str]:
        """
        Remarks: skipped columns, dropped blank rows.
        """
    @property
    def position_mm(self, /) -> NDArray[float64] | None:
        """
        Positions in the sensor frame (mm), shape (N, 3); ``None`` for a cable.
        """
    @property
    def q_deg(self, /) -> NDArray[float64]:
        """
        Logged joint angles of the controller (°), shape (N, 6).
        """
    @property
    def sensor(self, /) -> Literal["cable", "position", "pose"]:
        """
        ``cable``, ``position`` or ``pose``.
        """
    @property
    def sha256(self, /) -> str:
        """
        SHA-256 of the file's bytes, in hex.
        """

@final
class Deviation:
    """
    Deviation of a program on an arm.
    """
    def __repr__(self, /) -> str: ...
    def _repr_html_(self, /) -> str: ...
    @property
    def points(self, /) -> dict[str, list[Any]]:
        """
        The points of the path, one list per column of the table (mm, °); ``None`` for missing values.
        """
    def to_csv(self, /) -> str:
        """
        The points as CSV text: the bytes that ``truegrind deviation --csv`` writes.
        """
    def to_html(self, /) -> str:
        """
        The report as HTML.
        """
    def to_json(self, /) -> str:
        """
        The full result as JSON text, schema ``truegrind.deviation/1``: the bytes that ``truegrind deviation --json`` writes.
        """

@final
class Diagnosis:
    """
    Result of a diagnosis.
    """
    def __repr__(self, /) -> str: ...
    def _repr_html_(self, /) -> str: ...
    @property
    def findings(self, /) -> list[dict[str, Any]]:
        """
        The causes, largest first: dictionaries as in the JSON.
        """
    @property
    def geometry_rmse_mm(self, /) -> float:
        """
        Cross-validated RMS error with geometry alone (mm).
        """
    @property
    def held_out_rmse_mm(self, /) -> float:
        """
        Cross-validated RMS error with all causes (mm).
        """
    @property
    def model(self, /) -> Model:
        """
        The arm with the certain causes, for compensation.
        """
    @property
    def notes(self, /) -> list[str]:
        """
        Remarks.
        """
    @property
    def reasons(self, /) -> list[str]:
        """
        Reasons for the verdict, one sentence each.
        """
    @property
    def remaining(self, /) -> str | None:
        """
        The unexplained structure as a sentence; ``None`` if there is none.
        """
    def to_html(self, /) -> str:
        """
        The report as HTML.
        """
    def to_json(self, /) -> str:
        """
        The full result as JSON text, schema ``truegrind.diagnosis/1``: the bytes that ``truegrind diagnose --json`` writes.
        """
    @property
    def verdict(self, /) -> Literal["pass", "doubtful", "fail", "not-evaluated"]:
        """
        ``pass``, ``doubtful``, ``fail`` or ``not-evaluated``.
        """

@final
class Export:
    """
    The links of an estimated arm as a file of another format.
    """
    def __repr__(self, /) -> str: ...
    @property
    def is_whole(self, /) -> bool:
        """
        Whether the links are the whole model. Otherwise it has effects that no format holds, and the links alone are less accurate.
        """
    @property
    def notes(self, /) -> list[str]:
        """
        What the file leaves out, how its angles count, and the error of its links: sentences, which it contains too.
        """
    def save(self, /, path: str | PathLike[str]) -> None:
        """
        Writes the file.
        """
    @property
    def text(self, /) -> str:
        """
        The file.
        """

@final
class Identification:
    """
    Result of an identification.
    """
    def __repr__(self, /) -> str: ...
    def _repr_html_(self, /) -> str: ...
    @property
    def held_out(self, /) -> dict[str, NDArray[Any]]:
        """
        Errors of the held-out rows (mm): row numbers, before and after, each of shape (n,).
        """
    @property
    def held_out_max_mm(self, /) -> float:
        """
        Largest error on held-out rows (mm).
        """
    @property
    def held_out_rmse_before_mm(self, /) -> float:
        """
        RMS error on held-out rows of the nominal arm with a fitted sensor frame (mm).
        """
    @property
    def held_out_rmse_mm(self, /) -> float:
        """
        RMS error on held-out rows (mm).
        """
    @property
    def model(self, /) -> Model:
        """
        The estimated arm.
        """
    @property
    def noise_floor_mm(self, /) -> float | None:
        """
        Noise of sensor and rounding (mm); ``None`` if unknown.
        """
    @property
    def parameters(self, /) -> list[dict[str, Any]]:
        """
        All fitted parameters, including those of the sensor: dictionaries with name, unit, nominal, value, sigma, determined.
        """
    @property
    def reasons(self, /) -> list[str]:
        """
        Reasons for the verdict, one sentence each.
        """
    def to_html(self, /) -> str:
        """
        The report as HTML.
        """
    def to_json(self, /) -> str:
        """
        The full result as JSON text, schema ``truegrind.identification/1``: the bytes that ``truegrind identify --json`` writes.
        """
    @property
    def verdict(self, /) -> Literal["pass", "doubtful", "fail", "not-evaluated"]:
        """
        ``pass``, ``doubtful``, ``fail`` or ``not-evaluated``.
        """

@final
class Model:
    """
    An estimated arm: the nominal arm, everything identified, and its covariance.
    """
    def __new__(cls, /, path: str | PathLike[str]) -> Model:
        """
        Reads a model file.
        """
    def __reduce__(self, /) -> Any:
        """
        A pickle holds the model file; like the file, that of a failed fit is refused when it is read.
        """
    def __repr__(self, /) -> str: ...
    @property
    def covariance(self, /) -> NDArray[float64]:
        """
        Covariance of the arm's parameters (mm, rad), shape (p, p).
        """
    def export(self, /, format: "Literal['urdf', 'dh-csv', 'mdh-csv', 'ur-yaml']", *, dataset: Dataset | None = None, robot: Robot | str | PathLike[str] | None = None) -> Export:
        """
        The links in another format: ``"urdf"``, ``"dh-csv"``, ``"mdh-csv"`` (Craig) or ``"ur-yaml"`` (kinematics for the ROS drivers of
        Universal Robots). Effects beyond links are left out, as the notes of the result say. ``dataset``: measurements on which the error of
        the exported links is evaluated, with only the sensor's frame fitted. ``robot``: the robot file, if the robot of the model is not in
        the catalogue.
        """
    def forward(self, /, q_deg: ArrayLike, *, payload_kg: SupportsFloat | SupportsIndex | None = None, payload_centre_mm: SupportsLenAndGetItem[SupportsFloat | SupportsIndex] | None = None, temperature_c: SupportsFloat | SupportsIndex | None = None, time_h: SupportsFloat | SupportsIndex | None = None) -> Poses:
        """
        Poses of the flange in the base for controller angles (°) of shape (N, 6) or (6,): ``Poses(position_mm, rotation)``.
        Payload mass (kg) and its centre on the flange (mm), temperature (°C) and hours since power-on replace those of the
        measurement.
        """
    @staticmethod
    def from_toml(text: str, file: str = "model.toml") -> Model:
        """
        Parses the text of a model file; ``file``: its name in messages and reports.
        """
    @property
    def hash(self, /) -> str:
        """
        First twelve hex digits of the SHA-256 of the model file; written into corrected programs.
        """
    @property
    def held_out_rmse_before_mm(self, /) -> float:
        """
        RMS error on held-out rows of the nominal arm with a fitted sensor frame (mm).
        """
    @property
    def held_out_rmse_mm(self, /) -> float:
        """
        RMS error on held-out rows (mm).
        """
    def inverse(self, /, position_mm: ArrayLike, rotation: ArrayLike, near_deg: ArrayLike | None = None) -> Solutions:
        """
        Controller angles (°) at which this arm reaches poses of its flange: ``Solutions(q_deg, reached, why)``.
        """
    @staticmethod
    def load(path: str | PathLike[str]) -> Model:
        """
        Reads a model file.
        """
    def measured_at(self, /, q_deg: ArrayLike) -> NDArray[bool_]:
        """
        Whether controller angles (°) of shape (N, 6) or (6,) are in the measured region.
        """
    @property
    def nominal(self, /) -> Arm:
        """
        The nominal arm, used by the controller.
        """
    @property
    def order(self, /) -> list[str]:
        """
        Names of the parameters of the arm in the order of the covariance.
        """
    @property
    def parameters(self, /) -> list[dict[str, Any]]:
        """
        Identified parameters: dictionaries with name, unit, nominal, value, sigma, determined.
        """
    @property
    def reasons(self, /) -> list[str]:
        """
        Reasons for the verdict, one sentence each.
        """
    @property
    def robot(self, /) -> str:
        """
        Name of the robot.
        """
    def save(self, /, path: str | PathLike[str], *, allow_doubtful: bool = False) -> None:
        """
        Writes the model file; a doubtful model only if allowed, a failed one never.
        """
    def sigma_mm(self, /, q_deg: ArrayLike, tool_mm: SupportsLenAndGetItem[SupportsFloat | SupportsIndex] = ...) -> NDArray[float64]:
        """
        Predicted standard deviation of a point on the flange (mm), for controller angles (°) of shape (N, 6) or (6,). The point,
        such as a TCP, is stated in the flange (mm).
        """
    def to_toml(self, /) -> str:
        """
        The text of the model file.
        """
    @property
    def verdict(self, /) -> Literal["pass", "doubtful", "fail", "not-evaluated"]:
        """
        ``pass``, ``doubtful``, ``fail`` or ``not-evaluated``.
        """

@final
class Plan:
    """
    A measurement plan.
    """
    def __len__(self, /) -> int: ...
    def __repr__(self, /) -> str: ...
    def _repr_html_(self, /) -> str: ...
    @property
    def poses(self, /) -> dict[str, list[Any]]:
        """
        The rows in measuring order, one list per column of the table.
        """
    def program(self, /) -> str:
        """
        The RAPID program that moves to the poses.
        """
    def to_html(self, /) -> str:
        """
        The report as HTML.
        """
    def to_json(self, /) -> str:
        """
        The full result as JSON text, schema ``truegrind.plan/1``: the bytes that ``truegrind plan --json`` writes.
        """

@final
class Robot:
    """
    A robot with its nominal arm from the data sheet.
    """
    def __new__(cls, /, name: str | PathLike[str], *, base: str | None = None, tip: str | None = None, ground_joint_3: bool = False) -> Robot:
        """
        A robot by name (``truegrind.robots()``) or from a robot file: TOML, URDF, a table of link parameters (CSV), or the
        calibration of a Universal Robots arm (.conf, .yaml). ``base`` and ``tip``: base and flange link of a URDF.
        ``ground_joint_3``: the log states joint 3 relative to the ground, as FANUC controllers do.
        """
    def __repr__(self, /) -> str: ...
    def _repr_html_(self, /) -> str: ...
    @property
    def designation(self, /) -> str:
        """
        The maker's designation.
        """
    def forward(self, /, q_deg: ArrayLike) -> Poses:
        """
        Poses of the flange in the base for controller angles (°) of shape (N, 6) or (6,): ``Poses(position_mm, rotation)``.
        """
    @staticmethod
    def from_toml(text: str, file: str = "robot.toml") -> Robot:
        """
        Parses the text of a robot file; ``file``: its name in messages.
        """
    def inverse(self, /, position_mm: ArrayLike, rotation: ArrayLike, near_deg: ArrayLike | None = None) -> Solutions:
        """
        Controller angles (°) that reach poses of the flange: ``Solutions(q_deg, reached, why)``.
        """
    @property
    def maker(self, /) -> str:
        """
        Its maker.
        """
    @property
    def max_deg(self, /) -> NDArray[float64]:
        """
        Highest controller angles (°), shape (6,).
        """
    @property
    def min_deg(self, /) -> NDArray[float64]:
        """
        Lowest controller angles (°), shape (6,).
        """
    @property
    def name(self, /) -> str:
        """
        Name of the robot.
        """
    def to_html(self, /) -> str:
        """
        The report as HTML.
        """
    def to_json(self, /) -> str:
        """
        The data sheet as JSON text.
        """
    def to_toml(self, /) -> str:
        """
        The robot file (TOML) of this robot.
        """
    @property
    def understood(self, /) -> list[str]:
        """
        Interpretation of the robot file, to compare with the manual: zero pose, axes, flange; empty for the catalogue.
        """
    @property
    def warnings(self, /) -> list[str]:
        """
        Reservations about its data sheet, one sentence each.
        """

@final
class Simulation:
    """
    Simulated measurements.
    """
    def __repr__(self, /) -> str: ...
    @property
    def actual(self, /) -> Arm:
        """
        The arm that was measured.
        """
    @property
    def csv(self, /) -> str:
        """
        The measurement file (CSV).
        """
    @property
    def dataset(self, /) -> Dataset:
        """
        The measured rows.
        """

@final
class Toolpath:
    """
    A tool path on a surface, with the joints of the nominal arm that follow it.
    """
    def __len__(self, /) -> int: ...
    def __repr__(self, /) -> str: ...
    @property
    def position_mm(self, /) -> NDArray[float64]:
        """
        Points of the path in the work object (mm), shape (N, 3).
        """
    def program(self, /, control: "Literal['rapid', 'fanuc', 'siemens']" = "rapid", *, inline: bool = False) -> str:
        """
        The program: ``"rapid"``, ``"fanuc"`` (Fanuc style) or ``"siemens"`` (840D). ``inline``: the targets stand in the instructions of a
        RAPID program instead of declarations.
        """
    @property
    def q_deg(self, /) -> NDArray[float64]:
        """
        Controller angles of the nominal arm at each point (°), shape (N, 6).
        """
    def save(self, /, path: str | PathLike[str], *, inline: bool = False) -> None:
        """
        Writes the program: RAPID (.mod), Fanuc style (.nc) or Siemens 840D (.mpf), by the extension of the path.
        """
    @property
    def singularity(self, /) -> float:
        """
        Smallest distance to a singularity on the path, from 0.
        """

@final
class Track:
    """
    Result of tracking.
    """
    def __repr__(self, /) -> str: ...
    def _repr_html_(self, /) -> str: ...
    @property
    def alarms(self, /) -> list[dict[str, Any]]:
        """
        Alarms raised by these measurements: dictionaries as in the JSON.
        """
    @property
    def model(self, /) -> Model:
        """
        The current model.
        """
    @property
    def poses(self, /) -> int:
        """
        Number of processed poses.
        """
    @property
    def state(self, /) -> str:
        """
        The state, for ``track(..., state=...)``.
        """
    def to_html(self, /) -> str:
        """
        The report as HTML.
        """
    def to_json(self, /) -> str:
        """
        The full result as JSON text, schema ``truegrind.track/1``.
        """

def accept(model: Model | str | PathLike[str], dataset: Dataset, *, tolerance_mm: SupportsFloat | SupportsIndex, sensor_uncertainty_mm: SupportsFloat | SupportsIndex | None = None, tolerance_angle_deg: SupportsFloat | SupportsIndex | None = None, sensor_uncertainty_angle_deg: SupportsFloat | SupportsIndex | None = None, serials: dict | None = None, robot: Robot | str | PathLike[str] | None = None, sensor_frame: SupportsGetItem[int, SupportsFloat | SupportsIndex] | None = None, outlets_mm: SupportsGetItem[int, SupportsLenAndGetItem[SupportsFloat | SupportsIndex]] | None = None, cable_zeros_mm: SupportsGetItem[int, SupportsFloat | SupportsIndex] | None = None, touched_point: SupportsGetItem[int, SupportsFloat | SupportsIndex] | None = None, seed: SupportsIndex = 0, threads: SupportsIndex | None = None, progress: Callable[[str], object] | None = None) -> Acceptance:
    """
    Tests whether an estimated arm meets a tolerance at poses to which it was not fitted; at least 100 of them. ``tolerance_mm``: the largest
    accepted position error. ``sensor_uncertainty_mm``: expanded uncertainty of the sensor, k = 2; by default, and where it is smaller, that of
    repeated poses. ``tolerance_angle_deg`` and ``sensor_uncertainty_angle_deg``: the same for the orientation, for sensors that measure it.
    ``serials``: serial numbers and remarks for the report, such as ``{"arm": "120-503211"}``. ``robot``: the robot file of the model, if its
    robot is not in the catalogue. With ``sensor_frame`` (or ``outlets_mm`` and ``cable_zeros_mm``) and ``touched_point`` the placement of base
    and flange is tested too; without them the sensor is registered with these poses. Raises ``FitError`` for rows of the fit.
    """

def cell_file(program: str | PathLike[str] | Sequence[str | PathLike[str]] | Mapping[str, str | bytes], *, robot: Robot | str | PathLike[str] | None = None) -> str:
    """
    The text of a cell file (TOML) with every tool and frame that a program uses. Values that the program does not state are ``"?"`` and have to be
    filled in before ``compensate(..., cell=...)``. ``program``: as for ``compensate``. ``robot``: the robot that runs it, noted in the file.
    """

def compensate(program: str | PathLike[str] | Sequence[str | PathLike[str]] | Mapping[str, str | bytes], model: Model | str | PathLike[str], *, cell: str | PathLike[str] | None = None, surface: str | PathLike[str] | None = None, payload_kg: SupportsFloat | SupportsIndex | None = None, payload_centre_mm: SupportsLenAndGetItem[SupportsFloat | SupportsIndex] | None = None, temperature_c: SupportsFloat | SupportsIndex | None = None, emit: "Literal['targets', 'joints']" = "targets", circles: "Literal['keep', 'segments']" = "keep", tolerance_mm: SupportsFloat | SupportsIndex = 0.05, max_correction_mm: SupportsFloat | SupportsIndex = 10.0, partial: bool = False, placement: "Literal['auto', 'shape', 'absolute']" = "auto", max_risk: SupportsFloat | SupportsIndex = 0.1, joint_targets: bool = False, again: bool = False, allow_doubtful: bool = False, threads: SupportsIndex | None = None, progress: Callable[[str], object] | None = None) -> Compensation:
    """
    Corrects a program so that the real arm follows the intended path. ``program``: a path, a list of paths (modules of one task) or a
    dictionary of names and texts. ``cell``: a cell file or its text. ``surface``: a surface file. ``placement``: correct shape and place
    of the path in each work object ("absolute"), its shape alone ("shape"), or the place only where the model knows it better than it
    is off ("auto"). ``temperature_c``: temperature of the arm while the program runs, if the model says how its links grow; by default
    that of the measurement. A cut is left unchanged if its correction makes it worse with a probability above ``max_risk``. Nothing is written;
    use ``Compensation.save``.
    """

def deviation(program: str | PathLike[str] | Sequence[str | PathLike[str]] | Mapping[str, str | bytes], model: Model | str | PathLike[str], *, intended: str | PathLike[str] | Sequence[str | PathLike[str]] | Mapping[str, str | bytes] | None = None, actual: Arm | None = None, tolerance_mm: SupportsFloat | SupportsIndex = 0.05, cell: str | PathLike[str] | None = None, surface: str | PathLike[str] | None = None, payload_kg: SupportsFloat | SupportsIndex | None = None, payload_centre_mm: SupportsLenAndGetItem[SupportsFloat | SupportsIndex] | None = None, temperature_c: SupportsFloat | SupportsIndex | None = None, threads: SupportsIndex | None = None, progress: Callable[[str], object] | None = None) -> Deviation:
    """
    Deviation of a program under a model; nothing is rewritten. With ``intended``, the original program defines the intended path, and
    ``program`` is its corrected version; ``tolerance_mm`` is the largest deviation of its path between two targets. ``temperature_c``:
    as for ``compensate``. With ``actual`` (an
    ``Arm`` of a simulation) the programs are run on that arm.
    """

def diagnose(dataset: Dataset, robot: Robot | str | PathLike[str], *, alpha: SupportsFloat | SupportsIndex = 0.01, most: SupportsIndex = 20, blocks: SupportsIndex = 10, smooth: bool = False, fuse_readout: bool = True, limit_rmse_mm: SupportsFloat | SupportsIndex | None = None, limit_max_mm: SupportsFloat | SupportsIndex | None = None, tolerance_length_mm: SupportsFloat | SupportsIndex | None = None, tolerance_angle_deg: SupportsFloat | SupportsIndex | None = None, sensor_scale_sigma_percent: SupportsFloat | SupportsIndex | None = None, seed: SupportsIndex = 0, also: SupportsGetItem[int, Dataset] = ..., angles: "Literal['logged', 'dh'] | None" = None, sensor_frame: SupportsGetItem[int, SupportsFloat | SupportsIndex] | None = None, outlets_mm: SupportsGetItem[int, SupportsLenAndGetItem[SupportsFloat | SupportsIndex]] | None = None, cable_zeros_mm: SupportsGetItem[int, SupportsFloat | SupportsIndex] | None = None, touched_point: SupportsGetItem[int, SupportsFloat | SupportsIndex] | None = None, frame_sigma_mm: SupportsFloat | SupportsIndex | None = None, frame_sigma_deg: SupportsFloat | SupportsIndex | None = None, touched_sigma_mm: SupportsFloat | SupportsIndex | None = None, touched_sigma_deg: SupportsFloat | SupportsIndex | None = None, threads: SupportsIndex | None = None, progress: Callable[[str], object] | None = None) -> Diagnosis:
    """
    Finds the causes of errors that geometry does not explain. ``alpha``: probability of any false finding. ``most``: largest number of
    causes. ``blocks``: number of contiguous blocks held out in turn. Tolerances (mm, °): prior σ of the links.
    ``sensor_scale_sigma_percent``: standard uncertainty of the sensor's scale (%), such as 0.001 for a tracker that agreed with a scale
    bar; by default a fault of the scale is considered possible. ``also``: further datasets of the same arm, on which the models are tested
    with only the frames refitted. ``sensor_frame`` to ``touched_sigma_deg``: as for ``identify``.
    """

def forward(arm: Robot | Model | Arm, q_deg: ArrayLike, *, payload_kg: SupportsFloat | SupportsIndex | None = None, payload_centre_mm: SupportsLenAndGetItem[SupportsFloat | SupportsIndex] | None = None, temperature_c: SupportsFloat | SupportsIndex | None = None, time_h: SupportsFloat | SupportsIndex | None = None) -> Poses:
    """
    Poses of the flange of an arm (``Robot``, ``Model`` or ``Arm``), as its method ``forward``.
    """

def identify(dataset: Dataset, robot: Robot | str | PathLike[str], *, method: str = "lm", held_out: SupportsFloat | SupportsIndex = 0.2, seed: SupportsIndex = 0, fuse_readout: bool = True, limit_rmse_mm: SupportsFloat | SupportsIndex | None = None, limit_max_mm: SupportsFloat | SupportsIndex | None = None, tolerance_length_mm: SupportsFloat | SupportsIndex | None = None, tolerance_angle_deg: SupportsFloat | SupportsIndex | None = None, sensor_scale_sigma_percent: SupportsFloat | SupportsIndex | None = None, angles: "Literal['logged', 'dh'] | None" = None, sensor_frame: SupportsGetItem[int, SupportsFloat | SupportsIndex] | None = None, outlets_mm: SupportsGetItem[int, SupportsLenAndGetItem[SupportsFloat | SupportsIndex]] | None = None, cable_zeros_mm: SupportsGetItem[int, SupportsFloat | SupportsIndex] | None = None, touched_point: SupportsGetItem[int, SupportsFloat | SupportsIndex] | None = None, frame_sigma_mm: SupportsFloat | SupportsIndex | None = None, frame_sigma_deg: SupportsFloat | SupportsIndex | None = None, touched_sigma_mm: SupportsFloat | SupportsIndex | None = None, touched_sigma_deg: SupportsFloat | SupportsIndex | None = None, threads: SupportsIndex | None = None, progress: Callable[[str], object] | None = None) -> Identification:
    """
    Fits an arm to measured poses. ``robot``: a Robot, a name from ``truegrind.robots()`` or a robot file. ``held_out``: share of rows
    held out to estimate the error. Tolerances (mm, °): prior σ of the links. ``sensor_scale_sigma_percent``: standard uncertainty of the
    sensor's scale (%); by default a fault of the scale is considered possible. ``angles``: ``"logged"`` or ``"dh"``, by default that of
    the robot file. ``sensor_frame``: frame of a tracker or camera in the robot base, x, y, z (mm) or x, y, z, qw, qx, qy, qz;
    ``outlets_mm`` and ``cable_zeros_mm``: outlets of cables in the base, and reading minus free length of each; ``touched_point``: hook or
    reflector on the flange. With ``frame_sigma_mm`` (and ``frame_sigma_deg``; by default 1 mm at 1 m) and ``touched_sigma_mm`` (and
    ``touched_sigma_deg`` for the rotation of a target whose pose is measured), their standard deviations, the fit takes them as a prior, so that the placement of a path can be corrected; a placement that the readings contradict raises
    ``ArgumentError``. ``progress`` is called with each step. The result does not depend on the number of threads.
    """

def inverse(arm: Robot | Model | Arm, position_mm: ArrayLike, rotation: ArrayLike, near_deg: ArrayLike | None = None) -> Solutions:
    """
    Controller angles (°) at which an arm reaches poses of its flange, as its method ``inverse``.
    """

def path(surface: str | PathLike[str], robot: Robot | str | PathLike[str]) -> Toolpath:
    """
    Makes a grinding program from a surface file (TOML: surface, work object, tool and pattern), as ``truegrind path`` does. The joints are those
    of the nominal arm, which the controller computes with. Raises ``ProgramError`` if the robot cannot follow the path.
    """

def plan(robot: Robot | str | PathLike[str], sensor: "Literal['cable', 'position', 'pose']", *, poses: SupportsIndex | None = None, outlets_mm: SupportsGetItem[int, SupportsLenAndGetItem[SupportsFloat | SupportsIndex]] | None = None, cable_zeros_mm: SupportsGetItem[int, SupportsFloat | SupportsIndex] | None = None, sensor_frame: SupportsGetItem[int, SupportsFloat | SupportsIndex] | None = None, touched_point: SupportsGetItem[int, SupportsFloat | SupportsIndex] | None = None, diagnosis: Diagnosis | str | PathLike[str] | None = None, finding: SupportsIndex | None = None, index: "Literal['d', 'o1']" = "d", sigma_mm: SupportsFloat | SupportsIndex | None = None, sigma_angle_deg: SupportsFloat | SupportsIndex = 0.006, box_mm: SupportsLenAndGetItem[SupportsLenAndGetItem[SupportsFloat | SupportsIndex]] | None = None, range_mm: SupportsLenAndGetItem[SupportsFloat | SupportsIndex] | None = None, clearance_mm: SupportsFloat | SupportsIndex | None = None, keep_out_mm: SupportsGetItem[int, SupportsLenAndGetItem[SupportsLenAndGetItem[SupportsFloat | SupportsIndex]]] | None = None, floor_mm: SupportsFloat | SupportsIndex = 0.0, link_radius_mm: SupportsFloat | SupportsIndex | None = None, margin_deg: SupportsFloat | SupportsIndex = 6.0, singularity: SupportsFloat | SupportsIndex = 0.05, repeats: SupportsIndex = 4, both_sides: SupportsIndex = 12, warm_up: SupportsIndex = 8, approach_deg: SupportsFloat | SupportsIndex = 3.0, settle_s: SupportsFloat | SupportsIndex = 2.0, seconds_per_row: SupportsFloat | SupportsIndex = 12.0, speed_mm_s: SupportsFloat | SupportsIndex = 200.0, decisive: SupportsFloat | SupportsIndex = 25.0, candidates: SupportsIndex = 2000, seed: SupportsIndex = 0, threads: SupportsIndex | None = None, progress: Callable[[str], object] | None = None) -> Plan:
    """
    Chooses the poses to measure and makes a program that moves to them. ``sensor``: ``"cable"``, ``"position"`` or ``"pose"``. A cable
    needs its ``outlets_mm`` in the base; a tracker may stand anywhere (``sensor_frame``: where it stands). ``touched_point``: the hook or
    reflector on the flange. ``poses``: number of different poses, 60 by default. ``diagnosis``: a ``Diagnosis``, or its JSON file, whose ambiguous
    and untested causes the poses shall tell apart; ``finding``: for the finding with this number alone. ``index``: ``"d"`` (D-optimality) or
    ``"o1"``. ``box_mm``: lower and upper corner of a box for the measured point; ``range_mm``: shortest and longest distance to the sensor;
    ``keep_out_mm``: boxes that the arm must not enter, two corners each; all in the base. ``repeats``, ``both_sides``, ``warm_up``: poses measured two
    more times, poses measured again from the other side, visits of one pose over the run. The other keywords are the options of ``truegrind plan``.
    """

def robots() -> list[str]:
    """
    Names of the robots in the catalogue.
    """

def simulate(recipe: str | PathLike[str], *, seed: SupportsIndex | None = None, name: str = "simulated.csv") -> Simulation:
    """
    Simulates measurements of a given "actual" arm, with effects, noise and rounding. ``recipe``: a recipe file (TOML) or its text.
    ``seed``: seed of poses and noise, instead of that of the recipe.
    """

def track(model: Model | str | PathLike[str], datasets: Dataset | Sequence[Dataset], *, state: str | None = None, first_poses: SupportsIndex | None = None, sigma_mm: SupportsFloat | SupportsIndex | None = None, allow_odd_units: bool = False, threads: SupportsIndex | None = None, progress: Callable[[str], object] | None = None) -> Track:
    """
    Updates a model with new measurements: one dataset, or several in order. ``state``: state of an earlier track. ``first_poses``: number
    of poses that locate the sensor before tracking begins.
    """
