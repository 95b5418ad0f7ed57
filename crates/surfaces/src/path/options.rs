//! Options of a path over a surface.

use nalgebra::Vector3;
use serde::Deserialize;

use crate::error::SurfaceError;

/// The family of curves that a path follows.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
#[non_exhaustive]
pub enum Pattern {
    /// Straight passes over the whole domain, side by side.
    Raster,
    /// One curve from the centre outwards, over the ellipse inscribed in the domain, closed by a full turn along its rim.
    Spiral,
    /// Closed passes parallel to the border of the domain, from the border inwards.
    Contour,
}

/// Plan coordinate along which the passes of a raster run.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[serde(rename_all = "kebab-case")]
#[non_exhaustive]
pub enum Along {
    /// Along the first one, x or u.
    #[default]
    First,
    /// Along the second one, y or v.
    Second,
}

/// Whether every second pass of a raster is reversed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[serde(rename_all = "kebab-case")]
#[non_exhaustive]
pub enum Traverse {
    /// Back and forth.
    #[default]
    Zigzag,
    /// Always in the same direction, which keeps lead angle and cutting direction.
    OneWay,
}

/// Direction of the tool's x axis, about the tool's own z axis.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum ToolX {
    /// As near as possible to one direction in the surface's frame. The right choice for a rotating tool: the wrist moves
    /// little.
    Fixed(Vector3<f64>),
    /// Along the feed.
    Feed,
}

/// Distance of neighbouring passes.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum Spacing {
    /// Largest distance on the surface in mm.
    StepOver {
        /// The distance.
        step_over_mm: f64,
    },
    /// Largest height of the cusp that a ball-shaped tool leaves between two passes.
    Scallop {
        /// The height.
        scallop_mm: f64,
        /// Contact radius of the tool.
        tool_radius_mm: f64,
    },
}

/// Options of a path over a surface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PathOptions {
    /// The family of curves.
    pub pattern: Pattern,
    /// Direction of a raster's passes.
    pub along: Along,
    /// Whether a raster runs back and forth.
    pub traverse: Traverse,
    /// Distance of neighbouring passes.
    pub spacing: Spacing,
    /// Largest distance of neighbouring points in mm.
    pub max_step_mm: f64,
    /// Largest distance of the surface curve from the straight line between neighbouring points in mm.
    pub chord_mm: f64,
    /// Lead angle in rad: positive leans the spindle towards the feed, about the cross-feed axis.
    pub lead_rad: f64,
    /// Tilt angle in rad: positive leans the spindle to the left of the feed (seen with the outward normal up),
    /// about the feed direction.
    pub tilt_rad: f64,
    /// Rule for the tool's x axis.
    pub tool_x: ToolX,
    /// Height of approach, retract and link above the surface, along the normal in mm.
    pub approach_mm: f64,
}

impl Default for PathOptions {
    /// A raster along the first coordinate, passes and points 5 mm apart, tool normal to the surface with x near
    /// the frame's x, 20 mm up.
    fn default() -> Self {
        Self {
            pattern: Pattern::Raster,
            along: Along::First,
            traverse: Traverse::Zigzag,
            spacing: Spacing::StepOver { step_over_mm: 5.0 },
            max_step_mm: 5.0,
            chord_mm: 0.02,
            lead_rad: 0.0,
            tilt_rad: 0.0,
            tool_x: ToolX::Fixed(Vector3::x()),
            approach_mm: 20.0,
        }
    }
}

impl PathOptions {
    /// Largest number of points of a path.
    pub const MAX_POINTS: usize = 200_000;

    /// Refuses options for which no path can be made.
    ///
    /// # Errors
    /// The option, its value and acceptable values.
    pub fn check(&self) -> Result<(), SurfaceError> {
        let refuse = |option, found, expected| Err(SurfaceError::Option { option, found, expected });
        let positive = |value: f64| (f64::MIN_POSITIVE..=1e6).contains(&value);
        match self.spacing {
            Spacing::StepOver { step_over_mm } if !positive(step_over_mm) => {
                return refuse("step_over_mm", step_over_mm, "a length above 0, up to 1,000,000 mm");
            }
            Spacing::Scallop { tool_radius_mm, .. } if !positive(tool_radius_mm) => {
                return refuse("tool_radius_mm", tool_radius_mm, "a length above 0, up to 1,000,000 mm");
            }
            Spacing::Scallop { scallop_mm, tool_radius_mm }
                if !positive(scallop_mm) || scallop_mm >= tool_radius_mm =>
            {
                return refuse("scallop_mm", scallop_mm, "a height above 0 and below the tool's radius");
            }
            _ => {}
        }
        for (option, value) in [("max_step_mm", self.max_step_mm), ("chord_mm", self.chord_mm)] {
            if !positive(value) {
                return refuse(option, value, "a length above 0, up to 1,000,000 mm");
            }
        }
        for (option, value) in [("lead_deg", self.lead_rad), ("tilt_deg", self.tilt_rad)] {
            if value.is_nan() || value.abs() > 80_f64.to_radians() {
                return refuse(option, value.to_degrees(), "an angle from -80 to 80 degrees");
            }
        }
        if !(0.0..=1e4).contains(&self.approach_mm) {
            return refuse("approach_mm", self.approach_mm, "a height of 0 to 10,000 mm");
        }
        match self.tool_x {
            ToolX::Fixed(direction) if !(direction.norm() > 1e-9 && direction.norm().is_finite()) => {
                refuse("tool_x_direction", direction.norm(), "a direction with a length, such as [1, 0, 0]")
            }
            _ => Ok(()),
        }
    }
}
