//! Errors of a surface, its file, or a path over it.

use super::expression::ExpressionError;

/// Reason why there is no surface or no path.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SurfaceError {
    /// Not TOML, an unknown key, or a value of the wrong type.
    #[error("{file}, line {line}, column {column}: {message}")]
    Toml {
        /// Name of the file.
        file: String,
        /// Line, from 1.
        line: usize,
        /// Column in characters, from 1.
        column: usize,
        /// What was found and what was expected.
        message: String,
    },
    /// An invalid value.
    #[error("{file}, key `{key}`: found {found}, expected {expected}; {remedy}")]
    Value {
        /// Name of the file.
        file: String,
        /// Full name of the key, such as `path.step_over_mm`.
        key: String,
        /// What was found.
        found: String,
        /// What was expected.
        expected: String,
        /// What to do.
        remedy: String,
    },
    /// Another fault in what a file states.
    #[error("{file}, key `{key}`: {source}")]
    Stated {
        /// Name of the file.
        file: String,
        /// Full name of the key.
        key: String,
        /// What is wrong.
        source: Box<SurfaceError>,
    },
    /// An equation cannot be read.
    #[error(transparent)]
    Expression(#[from] ExpressionError),
    /// An equation without a finite value or a normal somewhere in its domain.
    #[error(
        "`{text}` is {found} at {place}, expected a finite value and a normal everywhere in the domain; shrink the \
         domain or correct the equation"
    )]
    NotFinite {
        /// The equation.
        text: String,
        /// Its value there.
        found: String,
        /// Where, such as `x = 1, y = 2`.
        place: String,
    },
    /// A range that is empty, reversed or not finite.
    #[error("the range of {name} is {from} to {to}, expected two finite numbers, the smaller first")]
    Range {
        /// Name of the coordinate.
        name: &'static str,
        /// First number.
        from: f64,
        /// Second number.
        to: f64,
    },
    /// An implicit equation has no zero below any point of its domain.
    #[error(
        "`{text}` = 0 has no point in the domain, expected a surface; check the sign and the ranges of x, y and z"
    )]
    Empty {
        /// The equation.
        text: String,
    },
    /// Bytes that are not an STL file, or triangles that form no surface.
    #[error("the mesh {problem}; {remedy}")]
    Mesh {
        /// What is wrong.
        problem: String,
        /// What to do.
        remedy: String,
    },
    /// An option for which no path can be made.
    #[error("{option} is {found}, expected {expected}")]
    Option {
        /// Name of the option.
        option: &'static str,
        /// Its value.
        found: f64,
        /// Acceptable values.
        expected: &'static str,
    },
    /// The tool does not fit into a hollow of the surface.
    #[error(
        "the surface is hollow with a radius of {hollow_mm:.3} mm near ({x:.3}, {y:.3}, {z:.3}) mm, less than the tool's \
         {tool_mm:.3} mm; take a smaller tool or leave that region out"
    )]
    Hollow {
        /// Radius of the hollow in mm.
        hollow_mm: f64,
        /// Radius of the tool in mm.
        tool_mm: f64,
        /// Where.
        x: f64,
        /// Where.
        y: f64,
        /// Where.
        z: f64,
    },
    /// The fixed direction of the tool's x axis is parallel to the tool's z axis somewhere.
    #[error(
        "the fixed direction of the tool's x axis is along the tool itself near ({x:.3}, {y:.3}, {z:.3}) mm; choose \
         another tool_x_direction, or tool_x = \"feed\""
    )]
    ToolX {
        /// Where.
        x: f64,
        /// Where.
        y: f64,
        /// Where.
        z: f64,
    },
    /// A path with too many points.
    #[error(
        "the path would have more than {limit} points; take a larger step-over, step or chord error, or a smaller domain"
    )]
    TooLong {
        /// The largest number of points.
        limit: usize,
    },
    /// A path that takes too long to compute.
    #[error(
        "the path would take more than {terms:e} terms of the equation, or as much of a mesh, to find; take a larger chord \
         error, step or step-over, a simpler equation, fewer waves or fewer triangles above each other"
    )]
    TooMuchWork {
        /// Largest number of evaluated terms.
        terms: f64,
    },
    /// No curve of the pattern meets the surface.
    #[error("no pass of the pattern meets the surface; check that the domain lies over the surface")]
    NoPass,
}
