//! Identified parameters of a method, as the papers print them, with standard deviation and observability.
//!
//! σ comes from (JᵀJ/s² + P⁻¹)⁻¹ at the method's result, with s² the residual variance of the rows and P the
//! manufacturing tolerances. It is therefore comparable for all methods, whether or not the method has a covariance or
//! used a prior. A parameter with less than half of its information from the data is marked as not observable: a method
//! without priors finds an arbitrary value for it.

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
    /// Link parameters, in the order of the chain.
    pub rows: Vec<ParameterRow>,
}

/// One parameter.
#[derive(Debug, Clone, PartialEq)]
pub struct ParameterRow {
    /// Parameter.
    pub parameter: Parameter,
    /// Nominal value (mm or rad).
    pub nominal: f64,
    /// Identified deviation (mm or rad).
    pub deviation: f64,
    /// Its standard deviation.
    pub sigma: f64,
    /// Share of the information that comes from the data.
    pub determined: f64,
    /// The deviation printed in the paper (mm or rad), if any.
    pub paper: Option<f64>,
}

impl ParameterRow {
    /// Whether the data determine the parameter.
    pub fn is_observable(&self) -> bool {
        self.determined >= 0.5
    }
}

/// The table of a method that ended at `x`; `variance` is the residual variance of a row of weight 1.
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
    // In units of the priors, in which the prior's information is the unit matrix.
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

/// Deviation printed in a paper for a parameter (mm or rad). The papers' classical links have an offset d where the axes of
/// joints 2 and 3 are parallel; ours have a rotation β instead, for which no value is printed.
fn stated(link: &PaperLink, coordinate: LinkCoordinate) -> Option<f64> {
    match coordinate {
        LinkCoordinate::A => link.a_mm,
        LinkCoordinate::D => link.d_mm,
        LinkCoordinate::Alpha => link.alpha_deg.map(f64::to_radians),
        LinkCoordinate::Theta => link.theta_deg.map(f64::to_radians),
        LinkCoordinate::Beta => None,
    }
}
