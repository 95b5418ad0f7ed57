//! Links from one pass to the next: up along the normal, across, and down along the normal.

use nalgebra::{Point3, Unit, Vector3};

use crate::budget::Budget;
use crate::contact::Contact;
use crate::error::SurfaceError;
use crate::surface::Surface;

/// Largest number of bisections of a link.
const HALVINGS: usize = 6;
/// Samples inside a piece of a link.
const SAMPLES: usize = 16;

/// A point of a link, with its share of the link (0…1).
#[derive(Debug, Clone, Copy)]
pub(crate) struct Stop {
    pub(crate) share: f64,
    pub(crate) position_mm: Point3<f64>,
    pub(crate) normal: Unit<Vector3<f64>>,
}

/// A point lifted off the surface along the normal.
pub(crate) fn lifted(contact: &Contact, height_mm: f64) -> Point3<f64> {
    contact.position_mm + contact.normal.into_inner() * height_mm
}

/// The points between the two lifted ends of a link that keep its straight pieces at least half the height above the surface.
/// None are needed over a flat surface; over a dome, the link follows it. Where there is no surface below, nothing obstructs
/// the link.
///
/// # Errors
/// A budget with fewer evaluations left.
pub(crate) fn over(
    surface: &Surface,
    from: &Contact,
    to: &Contact,
    height_mm: f64,
    budget: &Budget,
) -> Result<Vec<Stop>, SurfaceError> {
    let below = |share: f64| {
        let plan = [0, 1].map(|i| from.plan[i] * (1.0 - share) + to.plan[i] * share);
        surface.contact(plan)
    };
    let start = Stop { share: 0.0, position_mm: lifted(from, height_mm), normal: from.normal };
    let end = Stop { share: 1.0, position_mm: lifted(to, height_mm), normal: to.normal };
    let mut stops = vec![start, end];
    for _ in 0..HALVINGS {
        let mut closer = vec![start];
        budget.charge(SAMPLES * (stops.len() - 1))?;
        for pair in stops.windows(2) {
            let (a, b) = (pair[0], pair[1]);
            let clear = (1..SAMPLES).all(|i| {
                let part = i as f64 / SAMPLES as f64;
                let at = a.position_mm + (b.position_mm - a.position_mm) * part;
                below(a.share * (1.0 - part) + b.share * part)
                    .is_none_or(|c| c.normal.dot(&(at - c.position_mm)) >= 0.5 * height_mm)
            });
            let middle = 0.5 * (a.share + b.share);
            if !clear && let Some(contact) = below(middle) {
                let position_mm = lifted(&contact, height_mm);
                closer.push(Stop { share: middle, position_mm, normal: contact.normal });
            }
            closer.push(b);
        }
        if closer.len() == stops.len() {
            break;
        }
        stops = closer;
    }
    Ok(stops[1..stops.len() - 1].to_vec())
}
