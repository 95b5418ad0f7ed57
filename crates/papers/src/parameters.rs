//! What a method identified, as the papers print it, with what they leave out: how sure each number is, and which ones
//! the data cannot see.
//!
//! σ comes from (JᵀJ/s² + P⁻¹)⁻¹ at the method's result, with s² the variance that the rows are left with and P
//! manufacturing tolerances; it is thus the same kind of figure for every method, whether or not the method itself has
//! a covariance or used a prior. Where the data brought less than half of the knowledge, the parameter is marked as not
//! observable: what a method without priors writes there is an accident of its path.

use nalgebra::DMatrix;

use crate::experiment::{Method, PaperLink};
use truegrind_arm::parameter::{LinkCoordinate, Parameter};
use truegrind_calibration::identification::calibration::CalibrationProblem;
use truegrind_calibration::identification::tolerance::Tolerance;
use truegrind_estimation::problem::Problem;

/// Parameters of one method.
#[derive(Debug, Clone, PartialEq)]
pub struct ParameterTable {
    /// Id of the method.
    pub id: String,
    /// Its name.
    pub name: String,
    /// Link parameters, in their order.
    pub rows: Vec<ParameterRow>,
}

/// One parameter.
#[derive(Debug, Clone, PartialEq)]
pub struct ParameterRow {
    /// Which.
    pub parameter: Parameter,
    /// Nominal value (mm or rad).
    pub nominal: f64,
    /// Identified deviation (mm or rad).
    pub deviation: f64,
    /// Its standard deviation.
    pub sigma: f64,
    /// Share of the knowledge that the data brought.
    pub determined: f64,
    /// The deviation that the paper prints (mm or rad), where it does.
    pub paper: Option<f64>,
}

impl ParameterRow {
    /// Whether the data see the parameter.
    pub fn is_observable(&self) -> bool {
        self.determined >= 0.5
    }
}

/// The table of a method that ended at `x`; `variance` is what a row of weight 1 is left with.
pub fn parameter_table(
    method: &Method,
    problem: &CalibrationProblem,
    parameters: &[Parameter],
    x: &[f64],
    variance: f64,
) -> ParameterTable {
    let priors = Tolerance::default().priors(parameters, problem.start());
    let equations = problem.normal_equations(x);
    let p = parameters.len();
    // In units of the priors, where the unit matrix is the prior's information.
    let scaled = DMatrix::from_fn(p, p, |i, j| {
        let own = if i == j { 1.0 } else { 0.0 };
        equations.matrix[(i, j)] * priors[i].sigma * priors[j].sigma / variance.max(1e-12) + own
    });
    let covariance = scaled.cholesky().map(|factor| factor.inverse());
    let share = |k: usize| covariance.as_ref().map_or(1.0, |c| c[(k, k)].clamp(0.0, 1.0));
    let rows = parameters
        .iter()
        .enumerate()
        .filter_map(|(k, parameter)| {
            let Parameter::Link { joint, coordinate } = *parameter else { return None };
            Some(ParameterRow {
                parameter: *parameter,
                nominal: problem.start().links[joint].get(coordinate),
                deviation: x[k],
                sigma: priors[k].sigma * share(k).sqrt(),
                determined: 1.0 - share(k),
                paper: method.paper_links.get(joint).and_then(|link| stated(link, coordinate)),
            })
        })
        .collect();
    ParameterTable { id: method.id.clone(), name: method.name.clone(), rows }
}

/// What a paper states of a coordinate (mm or rad). Its classical links have d where the axes of joints 2 and 3 are
/// parallel; ours have a turn β there, of which it says nothing.
fn stated(link: &PaperLink, coordinate: LinkCoordinate) -> Option<f64> {
    match coordinate {
        LinkCoordinate::A => link.a_mm,
        LinkCoordinate::D => link.d_mm,
        LinkCoordinate::Alpha => link.alpha_deg.map(f64::to_radians),
        LinkCoordinate::Theta => link.theta_deg.map(f64::to_radians),
        LinkCoordinate::Beta => None,
    }
}
