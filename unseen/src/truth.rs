//! What is hidden, and which names of the diagnosis are true of it.

use crate::sensors::Kind as Sensor;

/// Where a cause belongs. A technician who is sent to the wrong one repairs what is whole.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Family {
    /// Links.
    Geometry,
    /// What yields under weight, joint or link.
    Compliance,
    /// Gear errors: eccentricity, transmission, ratio, coupling.
    Gear,
    /// Play.
    Backlash,
    /// Links that grow.
    Thermal,
    /// A load that the log does not tell of.
    Load,
    /// The sensor's stand, or the arm's base against it.
    Frame,
    /// The zero of a cable.
    Zero,
    /// The zero of a joint.
    JointZero,
    /// The scale of a sensor, or its distances.
    Scale,
    /// The wire of a cable sensor and what leads it.
    Cable,
    /// The air that a tracker looks through.
    Air,
    /// The target on the flange.
    Target,
    /// Noise and single wild readings.
    Noise,
    /// The set-up changed with time, without saying which part of it.
    SetUp,
    /// What the log says does not belong to what was read: rounding, lag, contradiction, a reading before the arm stood still.
    Log,
}

/// What a name of the diagnosis says.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Meaning {
    /// A cause.
    Cause(Family),
    /// That something is left without a name: never false, never an answer.
    SomethingElse,
    /// A name that this table does not know. Counted as false.
    Unknown,
}

/// The names of the diagnosis. One name stands for several families: see [`meanings`].
///
/// A name that is added to the diagnosis is added here, by what its sentence sends a technician to.
pub const NAMES: [(&str, Family); 50] = [
    ("link-geometry", Family::Geometry),
    ("joint-compliance", Family::Compliance),
    ("joint-stiffness", Family::Compliance),
    ("link-bending", Family::Compliance),
    ("link-twist", Family::Compliance),
    ("compliance", Family::Compliance),
    ("gear-eccentricity", Family::Gear),
    ("gear-transmission", Family::Gear),
    ("gear-ratio", Family::Gear),
    ("gear-two-joints", Family::Gear),
    ("gear-modulation", Family::Gear),
    ("gear-error", Family::Gear),
    ("axis-wobble", Family::Gear),
    ("joint-coupling", Family::Gear),
    ("drive", Family::Gear),
    ("backlash", Family::Backlash),
    ("backlash-load", Family::Backlash),
    ("thermal-growth", Family::Thermal),
    ("link-growth", Family::Thermal),
    ("payload-change", Family::Load),
    ("sensor-frame-shift", Family::Frame),
    ("sensor-frame-drift", Family::Frame),
    ("base-settling", Family::Frame),
    ("base-tilt", Family::Frame),
    ("sensor-zero-shift", Family::Zero),
    ("sensor-zero-drift", Family::Zero),
    ("joint-zero-shift", Family::JointZero),
    ("sensor-scale", Family::Scale),
    ("sensor-range", Family::Scale),
    ("sensor-axes", Family::Scale),
    ("lens-distortion", Family::Scale),
    ("sensor-scale-drift", Family::Scale),
    ("cable-sag", Family::Cable),
    ("cable-pulley", Family::Cable),
    ("cable-drum", Family::Cable),
    ("cable-reversal", Family::Cable),
    ("cable", Family::Cable),
    ("air-refraction", Family::Air),
    ("tool-shift", Family::Target),
    ("tool-drift", Family::Target),
    ("target-nest", Family::Target),
    ("target-droop", Family::Target),
    ("outliers", Family::Noise),
    ("correlated-noise", Family::Noise),
    ("setup-change", Family::SetUp),
    ("set-up-drift", Family::SetUp),
    ("angle-rounding", Family::Log),
    ("readout-mismatch", Family::Log),
    ("latency", Family::Log),
    ("unsettled", Family::Log),
];

/// Names that say that something is left.
pub const SOMETHING_ELSE: [&str; 4] =
    ["unexplained", "smooth-correction", "something-else", "small-disturbances"];

/// What a finding says. `thermal-drift` is told of the arm, of the sensor's frame and of a cable's zero, and of several of them in one
/// finding: its parameters say of which. Each counts as a name of its own.
pub fn meanings(effect: &str, parameters: &[String]) -> Vec<Meaning> {
    if SOMETHING_ELSE.contains(&effect) {
        return vec![Meaning::SomethingElse];
    }
    if effect == "thermal-drift" {
        let has = |names: &[&str]| parameters.iter().any(|p| names.contains(&p.as_str()));
        let told = [
            (Family::Thermal, has(&["growth", "growth per kelvin"])),
            (Family::Frame, has(&["x", "y", "z", "rx", "ry", "rz"])),
            (Family::Zero, has(&["offset"])),
        ];
        let families: Vec<Meaning> =
            told.into_iter().filter(|t| t.1).map(|(family, _)| Meaning::Cause(family)).collect();
        return if families.is_empty() { vec![Meaning::Cause(Family::Thermal)] } else { families };
    }
    let known = NAMES.iter().find(|(name, _)| *name == effect);
    vec![known.map_or(Meaning::Unknown, |(_, family)| Meaning::Cause(*family))]
}

/// Kinds of what is hidden.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Kind {
    /// Nothing.
    Clean,
    /// Links that warm up each by its own share, by two exponentials, and cool while the arm pauses.
    WarmLinks,
    /// A joint spring that hardens.
    Hardening,
    /// A joint that yields only beyond a torque.
    DeadBand,
    /// A link that bends.
    Bending,
    /// A gear error that depends on two joints.
    TwoJointGear,
    /// A gear error whose size changes along the turn.
    ModulatedGear,
    /// Play whose flank follows the load, and the last motion where the load is small.
    LoadedPlay,
    /// A cable over a pulley.
    Pulley,
    /// A cable wound in layers.
    Drum,
    /// A hanging cable on a spring.
    Catenary,
    /// A beam through warm layers of air.
    Refraction,
    /// A target whose centre depends on how it is looked at.
    Nest,
    /// Readings that drift.
    Drift,
    /// Autocorrelated noise.
    Correlated,
    /// Readings that belong to an earlier pose.
    Latency,
    /// Readings taken before the arm stood still.
    Unsettled,
    /// The arm's base settles.
    Settling,
    /// A joint loses counts of its encoder, or its belt slips.
    LostCounts,
    /// A tracker whose distances are off.
    Range,
    /// A target on a pole that droops.
    Droop,
    /// A pedestal that tilts under the arm.
    Tilt,
}

/// Parts of an arm that have something, from 1.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Parts {
    /// Joints.
    pub joints: Vec<usize>,
    /// Links of the data sheet.
    pub links: Vec<usize>,
}

impl Parts {
    /// One joint, from 0.
    pub fn joint(joint: usize) -> Self {
        Self { joints: vec![joint + 1], links: Vec::new() }
    }
}

/// What is true of a run.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Truth {
    /// What was hidden.
    pub kind: Kind,
    /// Families that are true of it.
    pub families: Vec<Family>,
    /// Parts that have it.
    pub parts: Parts,
}

/// What one finding is worth.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Mark {
    /// The family is true, and so are the joints where it names any.
    True,
    /// Another family.
    WrongFamily,
    /// The family is true, but of a joint that has nothing.
    WrongJoint,
    /// No cause: neither.
    None,
}

impl Kind {
    /// All of them.
    pub const ALL: [Kind; 22] = [
        Kind::Clean,
        Kind::WarmLinks,
        Kind::Hardening,
        Kind::DeadBand,
        Kind::Bending,
        Kind::TwoJointGear,
        Kind::ModulatedGear,
        Kind::LoadedPlay,
        Kind::Pulley,
        Kind::Drum,
        Kind::Catenary,
        Kind::Refraction,
        Kind::Nest,
        Kind::Drift,
        Kind::Correlated,
        Kind::Latency,
        Kind::Unsettled,
        Kind::Settling,
        Kind::LostCounts,
        Kind::Range,
        Kind::Droop,
        Kind::Tilt,
    ];

    /// Name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Kind::Clean => "clean",
            Kind::WarmLinks => "warm-links",
            Kind::Hardening => "hardening",
            Kind::DeadBand => "dead-band",
            Kind::Bending => "bending",
            Kind::TwoJointGear => "two-joint-gear",
            Kind::ModulatedGear => "modulated-gear",
            Kind::LoadedPlay => "loaded-play",
            Kind::Pulley => "pulley",
            Kind::Drum => "drum",
            Kind::Catenary => "catenary",
            Kind::Refraction => "refraction",
            Kind::Nest => "nest",
            Kind::Drift => "drift",
            Kind::Correlated => "correlated",
            Kind::Latency => "latency",
            Kind::Unsettled => "unsettled",
            Kind::Settling => "settling",
            Kind::LostCounts => "lost-counts",
            Kind::Range => "range",
            Kind::Droop => "droop",
            Kind::Tilt => "tilt",
        }
    }

    /// Whether it is in the arm, so that a model of the arm should have it.
    pub fn in_arm(self) -> bool {
        matches!(
            self,
            Kind::WarmLinks
                | Kind::Hardening
                | Kind::DeadBand
                | Kind::Bending
                | Kind::TwoJointGear
                | Kind::ModulatedGear
                | Kind::LoadedPlay
                | Kind::Tilt
        )
    }

    /// Whether there is a part that a technician could be sent to. Noise has none, and so has nothing.
    pub fn has_a_part(self) -> bool {
        !matches!(self, Kind::Clean | Kind::Correlated)
    }

    /// Whether only a cable has it, only a tracker, or either.
    pub fn sensors(self) -> [bool; 2] {
        match self {
            Kind::Pulley | Kind::Drum | Kind::Catenary => [true, false],
            Kind::Refraction | Kind::Nest | Kind::Range => [false, true],
            _ => [true, true],
        }
    }

    /// Families that are true of it under a sensor.
    ///
    /// A course in time may be told as a set-up that changed with time. A drum in layers has its radius wrong, so its scale is
    /// off. A base that settles under a sensor that stands still is a sensor that moves. Play whose flank follows the load
    /// is a spring of the same joint, as stiff as one likes.
    pub fn families(self, sensor: Sensor) -> Vec<Family> {
        match self {
            Kind::Clean => vec![],
            Kind::WarmLinks => vec![Family::Thermal, Family::SetUp],
            Kind::Hardening | Kind::DeadBand | Kind::Bending => vec![Family::Compliance],
            Kind::TwoJointGear | Kind::ModulatedGear => vec![Family::Gear],
            Kind::LoadedPlay => vec![Family::Backlash, Family::Compliance],
            Kind::Pulley | Kind::Catenary => vec![Family::Cable],
            Kind::Drum => vec![Family::Cable, Family::Scale],
            Kind::Refraction => vec![Family::Air],
            Kind::Nest | Kind::Droop => vec![Family::Target],
            Kind::Tilt => vec![Family::Frame],
            Kind::Drift if sensor == Sensor::Cable => vec![Family::Zero, Family::SetUp],
            Kind::Drift | Kind::Settling => vec![Family::Frame, Family::SetUp],
            Kind::Correlated => vec![Family::Noise],
            Kind::LostCounts => vec![Family::JointZero],
            Kind::Range => vec![Family::Scale],
            Kind::Latency | Kind::Unsettled => vec![Family::Log],
        }
    }
}

impl Truth {
    /// Marks a finding: its meaning and the numbers that it has for joints. Of a coupling, driver and driven joint, the driven one
    /// counts, and of a gear error that depends on two joints the first, whose gear it is; where links grow or bend the numbers are those of links.
    pub fn mark(&self, effect: &str, meaning: Meaning, joints: Option<&[usize]>) -> Mark {
        let family = match meaning {
            Meaning::SomethingElse => return Mark::None,
            Meaning::Unknown => return Mark::WrongFamily,
            Meaning::Cause(family) => family,
        };
        if !self.families.contains(&family) {
            return Mark::WrongFamily;
        }
        let told = match joints {
            Some([_, driven]) if effect == "joint-coupling" => &[*driven],
            Some([gear, _]) if effect == "gear-two-joints" => &[*gear],
            Some(joints) => joints,
            None => &[],
        };
        let of_links = family == Family::Thermal || effect.starts_with("link-");
        let have = if of_links { &self.parts.links } else { &self.parts.joints };
        if told.iter().all(|part| have.contains(part)) { Mark::True } else { Mark::WrongJoint }
    }
}
