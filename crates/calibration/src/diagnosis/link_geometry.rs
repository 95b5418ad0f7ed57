//! Links that are not the data sheet's: another variant of the arm, wrong units, or a wrong data sheet.

use super::cause_kind::CauseKind;
use super::contribution::Contributions;
use super::design::Linear;
use super::finding::{Confidence, Finding, FoundParameter, Gain};
use super::findings::FindingBuilder;
use super::words;
use crate::identification::fit::Fitted;
use crate::identification::parameter_table::parameter_table;
use crate::identification::tolerance::Tolerance;
use crate::identification::verdict::is_implausible;
use truegrind_arm::estimated::EstimatedParameter;
use truegrind_arm::parameter::{LinkCoordinate, Parameter};

/// z-score from which a link counts as deviating, since the wide priors of a diagnosis hardly constrain weakly observed links.
pub(super) const LINK_Z: f64 = 2.0;

/// The same from which it is a finding.
const SURE_LINK_Z: f64 = 6.0;

impl FindingBuilder<'_> {
    /// Findings of links that surely deviate by more than the `tolerance` of making them allows.
    pub(super) fn implausible_links(
        &self,
        linear: &Linear,
        contributions: &Contributions<'_>,
        tolerance: &Tolerance,
    ) -> Vec<Finding> {
        let table = parameter_table(&Fitted::from(self.extended), self.subject.nominal);
        let links = table.iter().zip(&self.extended.parameters).filter_map(|(link, parameter)| {
            let Parameter::Link { joint, coordinate } = *parameter else { return None };
            // The fit of all rows has parameters that the searched rows do not reach.
            let k = self.fit.parameters.iter().position(|p| p == parameter)?;
            Some((link, k, joint, coordinate))
        });
        // Where the law of a sensor is not known, links explain a part of it.
        let law = self.fit.causes.iter().find(|cause| cause.is_empirical() && !cause.is_in_arm());
        let confidence = if law.is_some() { Confidence::Ambiguous } else { Confidence::Identified };
        let doubts: Vec<String> = law
            .map(|cause| {
                format!(
                    "the rows contain {}, whose exact form is unknown: the links absorb a part of it",
                    cause.kind().words()
                )
            })
            .into_iter()
            .collect();
        links
            .filter(|(link, ..)| is_implausible(link, tolerance, SURE_LINK_Z))
            .map(|(link, k, joint, coordinate)| {
                let after = self.held.without(&[]).rmse_mm(None, self.set_aside);
                let before = self.held.without(&[k]).rmse_mm(None, self.set_aside);
                let gain = Gain { cv_rmse_before_mm: before, cv_rmse_after_mm: after };
                Finding {
                    joints: Some(vec![joint + 1]),
                    parameters: vec![deviation(link)],
                    worth_mm: Some(contributions.unique_of_parameter(linear, k)),
                    doubts: doubts.clone(),
                    ..words::finding(
                        CauseKind::LinkGeometry,
                        describe(joint + 1, coordinate, link),
                        confidence,
                        "no manufacturing tolerance is that large".to_owned(),
                        gain,
                    )
                }
            })
            .collect()
    }
}

fn deviation(parameter: &EstimatedParameter) -> FoundParameter {
    FoundParameter {
        name: format!("{} minus data sheet", parameter.name),
        value: parameter.value - parameter.nominal,
        sigma: Some(parameter.sigma),
        unit: parameter.unit.clone(),
    }
}

fn describe(link: usize, coordinate: LinkCoordinate, parameter: &EstimatedParameter) -> String {
    let off = parameter.value - parameter.nominal;
    let what = match coordinate {
        LinkCoordinate::A => "length a",
        LinkCoordinate::D => "offset d",
        LinkCoordinate::Alpha => "twist alpha",
        LinkCoordinate::Beta => "twist beta",
        LinkCoordinate::Theta => "joint zero",
    };
    let (sheet, off) = if coordinate.is_length() {
        (format!("{:.2} mm", parameter.nominal), format!("{:.2} mm {}", off.abs(), side(off)))
    } else {
        let degrees = off.to_degrees();
        (format!("{:.2}°", parameter.nominal.to_degrees()), format!("{:.2}° {}", degrees.abs(), side(off)))
    };
    format!(
        "link {link} is not the data sheet's: its {what} is {off} than {sheet}; another variant of the arm, another robot, or wrong units"
    )
}

fn side(off: f64) -> &'static str {
    if off < 0.0 { "less" } else { "more" }
}
