"""Rows from files, arrays and data frames: one set of checks, whatever they come from."""

import numpy as np
import pytest

import truegrind as tg

from conftest import DATA, PROGRAMS

NAMES = [f"q{joint}" for joint in range(1, 7)]


def columns() -> dict[str, np.ndarray]:
    rows = np.genfromtxt(DATA / "irb120-tracker.csv", delimiter=",", names=True)
    return {name: rows[name] for name in rows.dtype.names}


def same(a: tg.Dataset, b: tg.Dataset) -> bool:
    return np.array_equal(a.q_deg, b.q_deg) and np.array_equal(a.position_mm, b.position_mm)


def test_a_file_and_its_bytes_are_the_same():
    path = DATA / "irb120-tracker.csv"
    a, b = tg.Dataset.from_csv(path), tg.Dataset.from_csv(path.read_bytes(), name=path.name)
    assert same(a, b) and a.sha256 == b.sha256 and a.file == b.file == "irb120-tracker.csv"
    assert a.sensor in ("position", "pose") and len(a) == len(a.q_deg)


def test_arrays():
    table = columns()
    q = np.stack([table[name] for name in NAMES], axis=1)
    place = np.stack([table[f"measured_{axis}"] for axis in "xyz"], axis=1)
    given = tg.Dataset.from_numpy(np.asfortranarray(q), position_mm=place[::-1][::-1])
    file = tg.Dataset.from_csv(DATA / "irb120-tracker.csv")
    assert np.array_equal(given.q_deg, file.q_deg) and np.array_equal(given.position_mm, file.position_mm)


def test_stations_of_a_tracker_are_fitted_together():
    table = columns()
    q = np.stack([table[name] for name in NAMES], axis=1)
    place = np.stack([table[f"measured_{axis}"] for axis in "xyz"], axis=1)
    half = len(q) // 2
    moved = place.copy()
    moved[half:] = np.stack([500.0 - place[half:, 1], place[half:, 0] + 200.0, place[half:, 2]], axis=1)
    station = ["door"] * half + ["window"] * (len(q) - half)
    one = tg.identify(tg.Dataset.from_numpy(q, position_mm=place), "abb-irb-120")
    two = tg.identify(tg.Dataset.from_numpy(q, position_mm=moved, station=station), "abb-irb-120")
    assert two.held_out_rmse_mm < 1.1 * one.held_out_rmse_mm
    with pytest.raises(tg.DatasetError, match="station window"):
        lonely = ["door"] * (len(q) - 1) + ["window"]
        tg.identify(tg.Dataset.from_numpy(q, position_mm=place, station=lonely), "abb-irb-120")


@pytest.mark.parametrize("library", ["pandas", "polars", "pyarrow", "dict"])
def test_data_frames(library):
    table = columns()
    if library == "dict":
        frame = table
    elif library == "pyarrow":
        frame = pytest.importorskip("pyarrow").table(table)
    else:
        frame = pytest.importorskip(library).DataFrame(table)
    assert same(tg.Dataset.from_dataframe(frame), tg.Dataset.from_csv(DATA / "irb120-tracker.csv"))


class Buffer:
    def __init__(self, array: np.ndarray) -> None:
        self.array = array
        self.bufsize, self.ptr = array.nbytes, array.ctypes.data


class Column:
    """A column of the interchange protocol and nothing else; gaps are marked by a number of their own."""

    offset, metadata = 0, {}

    def __init__(self, values: np.ndarray, mark: float | None) -> None:
        self.values, self.mark = np.ascontiguousarray(values), mark
        kind = {"f": 2, "i": 0}[values.dtype.kind]
        self.dtype = (kind, values.dtype.itemsize * 8, values.dtype.char, "=")
        self.describe_null = (0, None) if mark is None else (2, mark)
        self.null_count = None

    def size(self) -> int:
        return len(self.values)

    def get_buffers(self):
        return {"data": (Buffer(self.values), self.dtype), "validity": None, "offsets": None}


class Frame:
    """A data frame of nobody's library: all that it has is the protocol, in chunks."""

    def __init__(self, columns: dict[str, np.ndarray], marks: dict[str, float], parts: int = 1) -> None:
        self._columns, self._marks, self._parts = columns, marks, parts

    def __dataframe__(self, nan_as_null: bool = False, allow_copy: bool = True):
        return _Interchange(self._columns, self._marks, self._parts)


class _Interchange:
    def __init__(self, columns, marks, parts) -> None:
        self._columns, self._marks, self._parts = columns, marks, parts

    def column_names(self):
        return iter(self._columns)

    def get_column_by_name(self, name):
        return Column(self._columns[name], self._marks.get(name))

    def get_chunks(self, n_chunks=None):
        pieces = {name: np.array_split(values, self._parts) for name, values in self._columns.items()}
        for part in range(self._parts):
            yield _Interchange({name: piece[part] for name, piece in pieces.items()}, self._marks, 1)


@pytest.mark.parametrize("parts", [1, 3])
def test_any_object_with_the_interchange_protocol_is_a_data_frame(parts):
    """No library of data frames is installed, or known, or asked."""
    table = columns()
    table["temperature"] = np.where(np.arange(len(table["q1"])) % 3 == 0, -999.0, 21.5)
    table["q2"] = table["q2"].astype(np.float64)
    given = Frame(table, {"temperature": -999.0}, parts)
    assert not hasattr(given, "columns") and not hasattr(given, "keys")
    assert same(tg.Dataset.from_dataframe(given), tg.Dataset.from_csv(DATA / "irb120-tracker.csv"))
    # A gap where a number has to be is told with its place, as in a file.
    table["q4"] = np.where(np.arange(len(table["q1"])) == 5, 10**6, 30).astype(np.int32)
    with pytest.raises(tg.DatasetError) as raised:
        tg.Dataset.from_dataframe(Frame(table, {"q4": 10**6}, parts))
    assert (raised.value.row, raised.value.column) == (5, "q4")


def workbook(path, rows: list[list[object]]) -> None:
    """The least that is a workbook."""
    import zipfile

    def cell(value: object) -> str:
        if isinstance(value, str):
            return f'<c t="inlineStr"><is><t>{value}</t></is></c>'
        return f"<c><v>{value!r}</v></c>"

    lines = "".join("<row>" + "".join(map(cell, row)) + "</row>" for row in rows)
    spreadsheet = "http://schemas.openxmlformats.org/spreadsheetml/2006/main"
    relations = "http://schemas.openxmlformats.org/package/2006/relationships"
    office = "http://schemas.openxmlformats.org/officeDocument/2006/relationships"
    types = "application/vnd.openxmlformats-officedocument.spreadsheetml"
    with zipfile.ZipFile(path, "w") as file:
        file.writestr(
            "[Content_Types].xml",
            '<Types xmlns="http://schemas.openxmlformats.org/package/2006/content-types">'
            '<Default Extension="rels" ContentType="application/vnd.openxmlformats-package.relationships+xml"/>'
            f'<Override PartName="/xl/workbook.xml" ContentType="{types}.sheet.main+xml"/>'
            f'<Override PartName="/xl/worksheets/sheet1.xml" ContentType="{types}.worksheet+xml"/></Types>',
        )
        file.writestr(
            "_rels/.rels",
            f'<Relationships xmlns="{relations}"><Relationship Id="r" Type="{office}/officeDocument" Target="xl/workbook.xml"/>'
            "</Relationships>",
        )
        file.writestr(
            "xl/workbook.xml",
            f'<workbook xmlns="{spreadsheet}" xmlns:r="{office}"><sheets><sheet name="Poses" sheetId="1" r:id="s"/></sheets></workbook>',
        )
        file.writestr(
            "xl/_rels/workbook.xml.rels",
            f'<Relationships xmlns="{relations}"><Relationship Id="s" Type="{office}/worksheet" Target="worksheets/sheet1.xml"/>'
            "</Relationships>",
        )
        file.writestr(
            "xl/worksheets/sheet1.xml", f'<worksheet xmlns="{spreadsheet}"><sheetData>{lines}</sheetData></worksheet>'
        )


def test_a_workbook_is_read_as_the_same_rows_of_a_text(tmp_path):
    table = columns()
    rows = [list(table), *([float(table[name][row]) for name in table] for row in range(len(table["q1"])))]
    workbook(tmp_path / "poses.xlsx", rows)
    assert same(tg.Dataset.from_xlsx(tmp_path / "poses.xlsx"), tg.Dataset.from_csv(DATA / "irb120-tracker.csv"))
    assert same(tg.Dataset.from_xlsx(tmp_path / "poses.xlsx", sheet="Poses"), tg.Dataset.from_csv(DATA / "irb120-tracker.csv"))
    with pytest.raises(tg.DatasetError, match="Poses"):
        tg.Dataset.from_xlsx(tmp_path / "poses.xlsx", sheet="Others")
    workbook(tmp_path / "wrong.xlsx", [[*NAMES, "L"], [1, 2, "three", 4, 5, 6, 500]])
    with pytest.raises(tg.DatasetError) as raised:
        tg.Dataset.from_xlsx(tmp_path / "wrong.xlsx")
    assert (raised.value.row, raised.value.column, raised.value.found) == (2, "q3", "`three`")


def test_gaps_and_text_of_a_data_frame():
    arrow = pytest.importorskip("pyarrow")
    count = 20
    table = {name: np.linspace(10, 50, count) + place for place, name in enumerate(NAMES)}
    table["L"] = np.linspace(300, 700, count)
    table["temperature"] = [None if row % 3 == 0 else 20.0 + row for row in range(count)]
    table["session"] = [None if row % 4 == 0 else "morning" for row in range(count)]
    whole = arrow.table(table)
    # In pieces, and beginning in the middle of a byte of marks.
    parts = arrow.concat_tables([whole.slice(0, 7), whole.slice(7, 6), whole.slice(13)])
    for frame in (whole, parts, whole.to_pandas() if _has("pandas") else whole):
        rows = tg.Dataset.from_dataframe(frame)
        assert len(rows) == count and rows.sensor == "cable"
    table["q3"] = [None if row == 11 else 20.0 for row in range(count)]
    with pytest.raises(tg.DatasetError) as raised:
        tg.Dataset.from_dataframe(arrow.table(table))
    assert (raised.value.row, raised.value.column, raised.value.found) == (11, "q3", "an empty cell")


def test_numbers_as_text_are_numbers_in_a_frame_too():
    arrow = pytest.importorskip("pyarrow")
    table = {name: values.tolist() for name, values in columns().items()}
    file = tg.Dataset.from_dataframe(table)
    texts = tg.Dataset.from_dataframe(arrow.table({**table, "q2": [repr(value) for value in table["q2"]]}))
    assert same(texts, file) and any("stored as text" in note for note in texts.notes)


@pytest.mark.parametrize("fault", ["two columns of one name", "a column of columns", "complex numbers", "lazy"])
def test_a_frame_that_cannot_be_read_is_a_dataset_error(fault):
    pandas = pytest.importorskip("pandas")
    frame = pandas.DataFrame(columns())
    if fault == "two columns of one name":
        frame = pandas.concat([frame, frame[["q1"]]], axis=1)
    elif fault == "a column of columns":
        frame = pandas.concat({"a": frame}, axis=1)
    elif fault == "complex numbers":
        frame = frame.astype({"q2": complex})
    else:
        frame = pytest.importorskip("polars").from_pandas(frame).lazy()
    with pytest.raises(tg.DatasetError, match="cannot be read"):
        tg.Dataset.from_dataframe(frame)


def _has(module: str) -> bool:
    try:
        __import__(module)
    except ImportError:
        return False
    return True


def test_errors_name_the_place():
    text = b"q1,q2,q3,q4,q5,q6,L\n10,20,30,40,50,60,500\n10,20,30,40,fifty,60,500\n"
    with pytest.raises(tg.DatasetError) as raised:
        tg.Dataset.from_csv(text, name="poses.csv")
    error = raised.value
    assert isinstance(error, tg.TruegrindError) and isinstance(error, ValueError)
    assert (error.file, error.row, error.column) == ("poses.csv", 3, "q5")
    assert error.found == "`fifty`" and error.expected == "a finite number"
    assert str(error).startswith("poses.csv, row 3, column q5: found `fifty`; expected a finite number")

    with pytest.raises(tg.DatasetError) as raised:
        tg.Dataset.from_numpy([[1, 2, 3, 4, 5, 6], [1, 2, np.nan, 4, 5, 6]], length_mm=[400, 500])
    assert (raised.value.row, raised.value.column, raised.value.file) == (1, "q3", "numpy")

    with pytest.raises(tg.DatasetError) as raised:
        tg.Dataset.from_dataframe({"q1": [1.0], "length": [2.0]})
    assert raised.value.row is None and "columns q2, q3, q4, q5 and q6 are missing" in raised.value.expected


@pytest.mark.parametrize(
    ("call", "kind", "words"),
    [
        (lambda: tg.Dataset.from_numpy(np.zeros((3, 7)), length_mm=np.zeros(3)), tg.ArgumentError, "(N, 6)"),
        (lambda: tg.Dataset.from_numpy(np.zeros((3, 6)), length_mm=np.zeros(2)), tg.ArgumentError, "one for each row"),
        (lambda: tg.Dataset.from_numpy(np.zeros((3, 6)), position_mm=np.zeros(3)), tg.ArgumentError, "position_mm"),
        (lambda: tg.Dataset.from_numpy("abc", length_mm=[1]), tg.ArgumentError, "an array of real numbers"),
        (lambda: tg.Dataset.from_csv(bytearray(10_000)), tg.ArgumentError, "…; expected a path, or bytes"),
        (lambda: tg.Dataset.from_numpy(np.zeros((1, 6)), length_mm=[1], time_h=np.zeros(1, "M8[s]")), tg.ArgumentError, "time_h"),
        (lambda: tg.Dataset.from_numpy(np.zeros((0, 6)), length_mm=[]), tg.DatasetError, "no rows"),
        (lambda: tg.Dataset.from_numpy(np.zeros((3, 6))), tg.DatasetError, "no sensor"),
        (lambda: tg.Dataset.from_dataframe(3), tg.DatasetError, "expected a data frame"),
        (lambda: tg.Dataset.from_csv("nowhere.csv"), FileNotFoundError, "nowhere.csv"),
        (lambda: tg.Dataset.from_csv(b"\x00\x01"), tg.DatasetError, "neither a text table"),
        (lambda: tg.Robot("abb-irb-121"), tg.RobotError, "abb-irb-120"),
        (lambda: tg.Robot.from_toml("[[robot]]\nnam = 1"), tg.RobotError, "robot.toml:2"),
        (lambda: tg.Model.load("nowhere.toml"), FileNotFoundError, "nowhere.toml"),
        (lambda: tg.Model.from_toml("a = 1"), tg.ModelError, "not a truegrind model"),
        (lambda: tg.Robot("abb-irb-120").forward(np.zeros((2, 5))), tg.ArgumentError, "(2, 5)"),
        (lambda: tg.Robot("abb-irb-120").forward(np.zeros((2, 2, 6))), tg.ArgumentError, "(2, 2, 6)"),
        (lambda: tg.Robot("abb-irb-120").inverse(np.zeros(3), np.ones((3, 3))), tg.ArgumentError, "rotation"),
        (lambda: tg.forward(7, np.zeros(6)), tg.ArgumentError, "a Robot, a Model or an Arm"),
        (lambda: tg.simulate("robot = 1\n"), tg.RecipeError, "expected a string"),
        (lambda: tg.plan("abb-irb-120", "cable"), tg.ArgumentError, "outlets_mm"),
        (lambda: tg.plan("abb-irb-120", "cable", outlets_mm=[[0.75, 0.2, 0.04]]), tg.PlanError, "multiply metres by 1000"),
        (lambda: tg.plan("abb-irb-120", "eye"), tg.ArgumentError, "sensor"),
        (lambda: tg.plan("abb-irb-120", "position", margin_deg=float("nan")), tg.ArgumentError, "margin_deg"),
        (lambda: tg.plan("abb-irb-120", "position", floor_mm=float("nan")), tg.ArgumentError, "floor_mm"),
        (lambda: tg.plan("abb-irb-120", "position", settle_s=-1.0), tg.ArgumentError, "settle_s"),
        (lambda: tg.plan("abb-irb-120", "position", seed=-1), tg.ArgumentError, "seed: found -1"),
        (lambda: tg.plan("abb-irb-120", "position", threads=-1), tg.ArgumentError, "threads: found -1"),
    ],
)
def test_bad_input_is_refused_in_words(call, kind, words):
    with pytest.raises(kind) as raised:
        call()
    assert words in str(raised.value)


def attributes(call) -> tuple:
    with pytest.raises(tg.TruegrindError) as raised:
        call()
    error = raised.value
    return error.file, error.row, error.column, error.found, error.expected


def test_every_kind_of_error_says_what_was_found_where(cable, model):
    """As attributes, so that no program has to take messages apart."""
    table = "q1,q2,q3,q4,q5,q6,L\n1,2,3,4,5,6,700\n"
    csv = lambda text: lambda: tg.Dataset.from_csv(text.encode(), name="a.csv")
    assert attributes(csv(table.replace("L", "L,q7"))) == ("a.csv", 1, "q7", "joint 7", "joints 1 to 6")
    assert attributes(csv(table.replace("q2", "q1"))) == ("a.csv", 1, "q1", "the column twice", "the column once")
    assert attributes(csv("")) == ("a.csv", None, None, "no rows", "a header line and one row for each measured pose")
    wide = "\n".join("1,2,3,4,5,6,700,10,20,0,0,50" for _ in range(5)) + "\n1,2,3\n"
    file, row, _, found, expected = attributes(csv(wide))
    assert (file, row) == ("a.csv", 6) and found.startswith("3 cells") and "12 numbers" in expected
    assert attributes(lambda: cable_of(cable, cable.length_mm / 25.4))[3] == "the sensor's lengths look like inches"
    toml = model.to_toml()
    other = toml.replace("truegrind.model/1", "truegrind.model/9")
    assert attributes(lambda: tg.Model.from_toml(other, "m.toml")) == ("m.toml", None, "schema", "truegrind.model/9", "truegrind.model/1")
    assert attributes(lambda: tg.Model.from_toml("a = \n", "m.toml"))[:2] == ("m.toml", 1)
    cell = lambda text: lambda: tg.compensate(PROGRAMS / "told.mod", model, cell=text, allow_doubtful=True)
    assert attributes(cell("angles = 'euler'\n"))[2:4] == ("angles", "euler")
    assert attributes(cell("\nangles =\n"))[1] == 2
    assert attributes(lambda: tg.simulate("seed = 1\nrobot = 1\n"))[:2] == ("recipe.toml", 2)
    assert attributes(lambda: tg.identify(cable, "abb-irb-120", method="guess"))[2:4] == ("method", "guess")
    assert attributes(lambda: tg.identify(cable, "abb-irb-120", threads=0))[2:4] == ("threads", "0")
    assert attributes(lambda: tg.identify(cable, "abb-irb-120", angles="rad"))[2:4] == ("angles", "rad")
    few = tg.Dataset.from_numpy(cable.q_deg[:3], length_mm=cable.length_mm[:3], name="few")
    assert attributes(lambda: tg.identify(few, "abb-irb-120"))[0] == "few"
    assert attributes(lambda: tg.track(model, few))[3:] == ("3 poses", "30 poses")
    empty = {"e.mod": "MODULE E\nENDMODULE\n"}
    assert attributes(lambda: tg.deviation(empty, model))[0] == "e.mod"


def cable_of(cable, length_mm) -> tg.Identification:
    return tg.identify(tg.Dataset.from_numpy(cable.q_deg, length_mm=length_mm), "abb-irb-120")


def test_wrong_units_and_arms_are_named(cable):
    q, length = cable.q_deg, cable.length_mm
    with pytest.raises(tg.DatasetError, match="radians") as raised:
        tg.Dataset.from_numpy(np.radians(q), length_mm=length)
    assert raised.value.expected == "degrees" and "allow_odd_units" in str(raised.value)
    with pytest.raises(tg.DatasetError, match="allow_odd_units=True"):
        tg.identify(tg.Dataset.from_numpy(q, length_mm=length / 25.4), "abb-irb-120")
    with pytest.raises(tg.FitError):
        tg.identify(tg.Dataset.from_numpy(q[:5], length_mm=length[:5]), "abb-irb-120")


def test_errors_travel_between_processes():
    import pickle

    with pytest.raises(tg.DatasetError) as raised:
        tg.Dataset.from_csv(b"q1,q2,q3,q4,q5,q6,L\n1,2,3,4,5,,6\n", name="a.csv")
    again = pickle.loads(pickle.dumps(raised.value))
    assert type(again) is tg.DatasetError and str(again) == str(raised.value)
    assert (again.file, again.row, again.column) == ("a.csv", 2, "q6")
