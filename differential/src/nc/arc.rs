//! Circular blocks: where their centre is, how far they go, and where they are half way.

/// How a block says its circle; mm, in the coordinates of the program.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Circle {
    /// By its centre along x, y and z; `None` where the block does not say it (then it is that of the start).
    Centre([Option<f64>; 3]),
    /// By a centre that is given whole elsewhere.
    Pole([f64; 3]),
    /// By its radius; below zero for more than half a turn.
    Radius(f64),
    /// By its opening angle (°), with the end.
    Opening(f64),
}

/// An arc; mm and rad. `mid` is the place half way.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Arc {
    /// Its centre in the plane.
    pub centre: [f64; 2],
    /// The distance of the start and of the end from it.
    pub radii: [f64; 2],
    /// How far it goes, anticlockwise above zero.
    pub sweep: f64,
    /// The place half way; the axis across the plane may be unknown.
    pub mid: [Option<f64>; 3],
}

/// The two axes of a plane: 17, 18 or 19.
pub fn axes(plane: u8) -> (usize, usize, usize) {
    match plane {
        18 => (2, 0, 1),
        19 => (1, 2, 0),
        _ => (0, 1, 2),
    }
}

/// Centre of the circle about two places of a plane, with a radius.
fn centre_of(from: [f64; 2], to: [f64; 2], radius: f64, anticlockwise: bool) -> Option<[f64; 2]> {
    let chord = [to[0] - from[0], to[1] - from[1]];
    let length = chord[0].hypot(chord[1]);
    if length < 1e-9 || 2.0 * radius.abs() < length - 2e-2 {
        return None;
    }
    let height = (radius * radius - length * length / 4.0).max(0.0).sqrt();
    let side = if anticlockwise == (radius > 0.0) { height } else { -height };
    Some([
        (from[0] + to[0]) / 2.0 - side * chord[1] / length,
        (from[1] + to[1]) / 2.0 + side * chord[0] / length,
    ])
}

/// The arc of a block; `None` where its start is not known or it is no circle.
pub fn arc(
    from: [Option<f64>; 3],
    to: [Option<f64>; 3],
    circle: Circle,
    anticlockwise: bool,
    plane: u8,
) -> Option<Arc> {
    let (a, b, across) = axes(plane);
    let (start, end) = ([from[a]?, from[b]?], [to[a]?, to[b]?]);
    let centre = match circle {
        Circle::Centre(centre) => [centre[a].unwrap_or(start[0]), centre[b].unwrap_or(start[1])],
        Circle::Pole(pole) => [pole[a], pole[b]],
        Circle::Radius(radius) => centre_of(start, end, radius, anticlockwise)?,
        Circle::Opening(degrees) => {
            let chord = (end[0] - start[0]).hypot(end[1] - start[1]);
            let radius = chord / 2.0 / (degrees.to_radians() / 2.0).sin();
            centre_of(start, end, if degrees > 180.0 { -radius } else { radius }, anticlockwise)?
        }
    };
    let spoke = |place: [f64; 2]| (place[0] - centre[0], place[1] - centre[1]);
    let ((x, y), (u, v)) = (spoke(start), spoke(end));
    let radii = [x.hypot(y), u.hypot(v)];
    if radii[0] < 1e-6 || radii[1] < 1e-6 {
        return None;
    }
    let turn = std::f64::consts::TAU;
    let mut sweep = (v.atan2(u) - y.atan2(x)).rem_euclid(turn);
    // An end that is the start goes all the way round.
    let gap = (end[0] - start[0]).hypot(end[1] - start[1]);
    if gap < 1e-7 * radii[0].max(1.0) {
        sweep = 0.0;
    }
    if anticlockwise {
        sweep = if sweep <= 0.0 { turn } else { sweep };
    } else {
        sweep -= turn;
    }
    let angle = y.atan2(x) + sweep / 2.0;
    let radius = (radii[0] + radii[1]) / 2.0;
    let mut mid = to;
    mid[a] = Some(centre[0] + radius * angle.cos());
    mid[b] = Some(centre[1] + radius * angle.sin());
    mid[across] = from[across].zip(to[across]).map(|(from, to)| (from + to) / 2.0);
    Some(Arc { centre, radii, sweep, mid })
}
