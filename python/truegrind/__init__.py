"""truegrind learns how one real robot arm differs from its data sheet, names the causes, and corrects RAPID and NC programs so
that the real arm follows the intended path.

Lengths are millimetres and angles degrees; names of dimensional values contain the unit (``q_deg``, ``position_mm``). Joint angles are
those displayed by the controller. Three models of an arm are distinguished: *nominal* (the data sheet, used by the controller),
*estimated* (nominal plus everything identified) and *actual* (the real arm, known only in a simulation).

>>> import truegrind as tg
>>> rows = tg.Dataset.from_csv("poses.csv")                       # doctest: +SKIP
>>> found = tg.diagnose(rows, "abb-irb-120")                      # doctest: +SKIP
>>> tg.compensate("blade.mod", found.model).save("blade-real.mod")  # doctest: +SKIP
"""

from ._results import Poses, Solutions
from ._truegrind import (
    Arm,
    Compensation,
    Dataset,
    Deviation,
    Diagnosis,
    Identification,
    Model,
    Plan,
    Robot,
    Simulation,
    Track,
    __version__,
    compensate,
    deviation,
    diagnose,
    forward,
    identify,
    inverse,
    plan,
    robots,
    simulate,
    track,
)
from .errors import (
    ArgumentError,
    CellError,
    DatasetError,
    Defect,
    FitError,
    InverseError,
    ModelError,
    PlanError,
    ProgramError,
    RecipeError,
    RobotError,
    TrackError,
    TruegrindError,
)

__all__ = [
    "Arm",
    "ArgumentError",
    "CellError",
    "Compensation",
    "Dataset",
    "DatasetError",
    "Defect",
    "Deviation",
    "Diagnosis",
    "FitError",
    "Identification",
    "InverseError",
    "Model",
    "ModelError",
    "Plan",
    "PlanError",
    "Poses",
    "ProgramError",
    "RecipeError",
    "Robot",
    "RobotError",
    "Simulation",
    "Solutions",
    "Track",
    "TrackError",
    "TruegrindError",
    "__version__",
    "compensate",
    "deviation",
    "diagnose",
    "forward",
    "identify",
    "inverse",
    "plan",
    "robots",
    "simulate",
    "track",
]
