//! The axes along which residuals are differentiated.

/// The axes along which a residual is differentiated. Its length, and with it the cost and the gradient, are the same along all.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in crate::identification::calibration) enum Axes {
    /// Of the base, as residuals are written.
    Base,
    /// Of the sensor's frame. Only then do the derivatives vanish where base and sensor turn together about the first joint, which no
    /// row sees: along the base's axes the residual itself turns, and JᵀJ shows curvature where the cost has none.
    Sensor,
}
