//! Types as Python states them, where a Rust type does not tell: `truegrind/_truegrind.pyi` is generated from these and from the
//! signatures.

use std::marker::PhantomData;
use std::ops::Deref;
use std::path::PathBuf;

use pyo3::inspect::{PyStaticConstant, PyStaticExpr};
use pyo3::prelude::*;
use pyo3::{PyTypeInfo, type_hint_identifier, type_hint_subscript, type_hint_union};

use crate::dataset::PyDataset;
use crate::fits::PyDiagnosis;
use crate::model::PyModel;
use crate::robot::{PyArm, PyRobot};

/// A type of Python.
pub(crate) trait Hint {
    const TYPE: PyStaticExpr;
}

/// An argument or a result that converts as `T` does, and whose type is `H`.
pub(crate) struct Typed<H, T>(T, PhantomData<H>);

/// An object of type `H`.
pub(crate) type Object<'py, H> = Typed<H, Bound<'py, PyAny>>;

impl<H, T> From<T> for Typed<H, T> {
    fn from(value: T) -> Self {
        Self(value, PhantomData)
    }
}

impl<H, T> Deref for Typed<H, T> {
    type Target = T;

    fn deref(&self) -> &T {
        &self.0
    }
}

impl<'a, 'py, H: Hint, T: FromPyObject<'a, 'py>> FromPyObject<'a, 'py> for Typed<H, T> {
    type Error = T::Error;

    const INPUT_TYPE: PyStaticExpr = H::TYPE;

    fn extract(object: Borrowed<'a, 'py, PyAny>) -> Result<Self, T::Error> {
        T::extract(object).map(Self::from)
    }
}

impl<'py, H: Hint, T: IntoPyObject<'py>> IntoPyObject<'py> for Typed<H, T> {
    type Target = T::Target;
    type Output = T::Output;
    type Error = T::Error;

    const OUTPUT_TYPE: PyStaticExpr = H::TYPE;

    fn into_pyobject(self, py: Python<'py>) -> Result<T::Output, T::Error> {
        self.0.into_pyobject(py)
    }
}

const fn text(value: &'static str) -> PyStaticExpr {
    PyStaticExpr::Constant { value: PyStaticConstant::Str(value) }
}

const ANY: PyStaticExpr = type_hint_identifier!("typing", "Any");
const BYTES: PyStaticExpr = type_hint_identifier!("builtins", "bytes");
const DICT: PyStaticExpr = type_hint_identifier!("builtins", "dict");
const LIST: PyStaticExpr = type_hint_identifier!("builtins", "list");
const LITERAL: PyStaticExpr = type_hint_identifier!("typing", "Literal");
const MAPPING: PyStaticExpr = type_hint_identifier!("collections.abc", "Mapping");
const NDARRAY: PyStaticExpr = type_hint_identifier!("numpy.typing", "NDArray");
const PATH: PyStaticExpr = <PathBuf as FromPyObject<'static, 'static>>::INPUT_TYPE;
const SEQUENCE: PyStaticExpr = type_hint_identifier!("collections.abc", "Sequence");
const STR: PyStaticExpr = type_hint_identifier!("builtins", "str");

macro_rules! hints {
    ($($name:ident = $hint:expr;)*) => {$(
        pub(crate) enum $name {}
        impl Hint for $name {
            const TYPE: PyStaticExpr = $hint;
        }
    )*};
}

hints! {
    Anything = ANY;
    ArrayLike = type_hint_identifier!("numpy.typing", "ArrayLike");
    Arrays = type_hint_subscript!(DICT, STR, type_hint_subscript!(NDARRAY, ANY));
    Bools = type_hint_subscript!(NDARRAY, type_hint_identifier!("numpy", "bool_"));
    Columns = type_hint_subscript!(DICT, STR, type_hint_subscript!(LIST, ANY));
    Counts = type_hint_subscript!(DICT, STR, type_hint_identifier!("builtins", "int"));
    Decisions = type_hint_subscript!(LITERAL, text("accepted"), text("refused"), text("undecided"), text("not-evaluated"));
    Dictionaries = type_hint_subscript!(LIST, type_hint_subscript!(DICT, STR, ANY));
    Files = type_hint_subscript!(DICT, STR, BYTES);
    Floats = type_hint_subscript!(NDARRAY, type_hint_identifier!("numpy", "float64"));
    Judgements = type_hint_subscript!(LITERAL, text("pass"), text("doubtful"), text("fail"), text("not-evaluated"));
    NamedArm = type_hint_union!(PyRobot::TYPE_HINT, PyModel::TYPE_HINT, PyArm::TYPE_HINT);
    NamedDiagnosis = type_hint_union!(PyDiagnosis::TYPE_HINT, PATH);
    NamedModel = type_hint_union!(PyModel::TYPE_HINT, PATH);
    NamedRobot = type_hint_union!(PyRobot::TYPE_HINT, PATH);
    OneOrMoreDatasets =
        type_hint_union!(PyDataset::TYPE_HINT, type_hint_subscript!(SEQUENCE, PyDataset::TYPE_HINT));
    PathOrBytes = type_hint_union!(PATH, BYTES);
    PathOrText = PATH;
    Poses = type_hint_identifier!("truegrind._results", "Poses");
    ProgramFiles = type_hint_union!(
        PATH,
        type_hint_subscript!(SEQUENCE, PATH),
        type_hint_subscript!(MAPPING, STR, type_hint_union!(STR, BYTES))
    );
    Progress = type_hint_subscript!(
        type_hint_identifier!("collections.abc", "Callable"),
        PyStaticExpr::List { elts: &[STR] },
        type_hint_identifier!("builtins", "object")
    );
    Sensors = type_hint_subscript!(LITERAL, text("cable"), text("position"), text("pose"));
    Solutions = type_hint_identifier!("truegrind._results", "Solutions");
}
