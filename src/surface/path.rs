//! The path of a tool over a surface: passes, tool frames, approach, retract and links.
//!
//! **Method.** A pattern is a family of curves over the plan of the surface ([`pattern`]). The distance between neighbouring
//! curves is the step-over, or follows from the scallop height ([`sampling`](super::sampling)); along a curve, points are as far apart as
//! the chord error and the largest step allow. Each point gets a tool frame ([`frame`]). Passes are joined by a retract
//! along the normal, a link that stays clear of the surface, and an approach along the normal ([`link`]).
//!
//! **Shapes.** A list of [`PathPoint`], in the order in which the tool visits them, in the surface's frame (the work object).
//!
//! **Stops.** Never iterates without bound: the number of passes and points is known before they are made, and a path of
//! more than [`PathOptions::LARGEST`] points is refused.
//!
//! **Source and departures.** ltlm-2024, "Grinding compensation experiment", takes path points from the surface equation of the
//! component and prints no more; pattern, spacing and frames here are the usual ones of computer-aided manufacturing.
//!
//! **Checked against.** The cusp measured between two neighbouring passes of a ball on a plane and on a cylinder, chord
//! errors measured on the surface, frames right-handed and at the stated angle to the normal.

pub mod pattern;
pub mod frame;
pub mod link;

use nalgebra::{Point3, Translation3, Unit, UnitQuaternion, Vector3};
use serde::Deserialize;

use crate::math::se3::Pose;

/// What the tool does on the way to a point.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum PointKind {
    /// Comes down along the normal, not yet in contact: the point above the first cut of a pass.
    Approach,
    /// In contact with the surface.
    Cut,
    /// Leaves along the normal: the point above the last cut of a pass.
    Retract,
    /// Moves above the surface from one pass to the next.
    Link,
}

/// One point of a path, in the surface's frame (the work object).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PathPoint {
    /// Where the TCP shall be. On a cut this is the contact point; lead and tilt turn the tool about it.
    pub position_mm: Point3<f64>,
    /// Outward unit normal of the surface at the contact point (of an approach, retract or link: at the point below).
    pub normal: Unit<Vector3<f64>>,
    /// Unit feed direction, tangential to the surface.
    pub feed: Unit<Vector3<f64>>,
    /// Orientation of the tool. The columns of its rotation matrix are the tool's axes: z points into the surface, the
    /// frame is right-handed.
    pub orientation: UnitQuaternion<f64>,
    /// What the tool does on the way to this point.
    pub kind: PointKind,
    /// Which pass the point belongs to, counted from 0 in the order of cutting; a link belongs to the pass it leads to.
    pub pass: usize,
}

impl PathPoint {
    /// The tool frame as a pose: position and orientation in the surface's frame (the work object).
    pub fn work_object_from_tool(&self) -> Pose {
        Pose::from_parts(Translation3::from(self.position_mm), self.orientation)
    }

    /// The direction in which the tool points, into the surface.
    pub fn tool_z(&self) -> Unit<Vector3<f64>> {
        self.orientation * Vector3::z_axis()
    }
}

/// The family of curves that a path follows.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Pattern {
    /// Straight passes over the whole domain, side by side.
    Raster,
    /// One curve from the middle outwards, over the ellipse inscribed in the domain, closed by a full turn along its rim.
    Spiral,
    /// Closed passes parallel to the border of the domain, from the border inwards.
    Contour,
}

/// Along which plan coordinate the passes of a raster run.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Along {
    /// Along the first one, x or u.
    #[default]
    First,
    /// Along the second one, y or v.
    Second,
}

/// Whether every second pass of a raster runs backwards.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Traverse {
    /// To and fro.
    #[default]
    Zigzag,
    /// Always in the same direction, which keeps lead angle and cutting direction.
    OneWay,
}

/// Where the tool's x axis points, about the tool's own z axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ToolX {
    /// As near as possible to one direction in the surface's frame. The right choice for a tool that turns about its z axis: the wrist
    /// stays calm.
    Fixed(Vector3<f64>),
    /// Along the feed.
    Feed,
}

/// How far apart neighbouring passes are.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Spacing {
    /// Largest distance on the surface [mm].
    StepOver {
        /// The distance.
        step_over_mm: f64,
    },
    /// Largest height of the cusp that a ball-shaped tool leaves between two passes.
    Scallop {
        /// The height.
        scallop_mm: f64,
        /// Radius of the tool where it touches.
        tool_radius_mm: f64,
    },
}

/// Everything that a path is made from besides the surface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PathOptions {
    /// The family of curves.
    pub pattern: Pattern,
    /// Direction of a raster's passes.
    pub along: Along,
    /// Whether a raster runs to and fro.
    pub traverse: Traverse,
    /// Distance of neighbouring passes.
    pub spacing: Spacing,
    /// Largest distance of neighbouring points [mm].
    pub max_step_mm: f64,
    /// Largest distance of the surface curve from the straight line between neighbouring points [mm].
    pub chord_mm: f64,
    /// Lead angle [rad]: positive leans the spindle towards the feed, about the cross-feed axis.
    pub lead_rad: f64,
    /// Tilt angle [rad]: positive leans the spindle to the left of the feed (seen with the outward normal up), about the
    /// feed direction.
    pub tilt_rad: f64,
    /// Rule for the tool's x axis.
    pub tool_x: ToolX,
    /// Height of approach, retract and link above the surface, along the normal [mm].
    pub approach_mm: f64,
}
