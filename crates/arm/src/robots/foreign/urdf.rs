//! URDF: the joints between two links of a tree.
//!
//! The arm within the tree is not guessed: a tree with exactly one chain of six moving joints is unambiguous, with the flange in
//! `tool0` or `flange` if present; any other requires base and tip. Lengths are metres and angles radians; links after a fixed
//! joint belong to the link before it, with their masses.

use std::borrow::Cow;
use std::collections::{BTreeMap, BTreeSet};

use nalgebra::{Point3, UnitVector3, Vector3};
use roxmltree::{Document, Node, ParsingOptions};

use super::chain::{ForeignArm, Mesh, Step, from_rpy};
use super::common::{ImportOptions, foreign_error, maker_of};
use crate::body::Body;
use crate::bounds::{self, display_number};
use crate::robots::error::RobotError;
use truegrind_math::se3::Pose;

/// Far more than any robot description contains.
const MAX_NODES: u32 = 1_000_000;

/// Names of the flange link, in order of precedence.
const FLANGES: [&str; 4] = ["tool0", "flange", "ee_link", "tool_link"];

#[derive(Debug, Clone, PartialEq)]
enum JointKind {
    Fixed,
    Revolute,
    Prismatic,
    Mimic(String),
    Other(String),
}

#[derive(Debug, Clone)]
struct Joint<'a> {
    name: &'a str,
    parent: &'a str,
    child: &'a str,
    before: Pose,
    axis: Vector3<f64>,
    kind: JointKind,
    limits_rad: Option<[f64; 2]>,
    speed_rad_s: Option<f64>,
    line: u32,
}

impl Joint<'_> {
    fn is_moving(&self) -> bool {
        self.kind != JointKind::Fixed
    }

    /// Refuses a place that no link of an arm has.
    fn check_length(&self, file: &str) -> Result<(), RobotError> {
        let metres = self.before.translation.vector / 1000.0;
        if metres.iter().all(|length| bounds::LENGTH_MM.contains(1000.0 * length)) {
            return Ok(());
        }
        let shown: Vec<String> = metres.iter().map(|&length| shown(length)).collect();
        Err(foreign_error(
            file,
            format!("line {}, joint {}, <origin xyz>", self.line, self.name),
            format!("`{}`", shown.join(" ")),
            "metres, within ±10",
            "if these are millimetres, divide every length of the file by 1000",
        ))
    }

    /// Refuses a range in degrees, and one without angles in it.
    fn check_limits(&self, file: &str) -> Result<(), RobotError> {
        let Some([low, high]) = self.limits_rad else { return Ok(()) };
        let (expected, remedy) =
            if ![low, high].iter().all(|angle| bounds::JOINT_DEG.contains(angle.to_degrees())) {
                ("radians, within ±62.8", "if these are degrees, divide every angle of the file by 57.29578")
            } else if low >= high {
                ("lower below upper", "swap or correct them")
            } else {
                return Ok(());
            };
        Err(foreign_error(
            file,
            format!("line {}, joint {}, <limit>", self.line, self.name),
            format!("lower {} and upper {}", shown(low), shown(high)),
            expected,
            remedy,
        ))
    }
}

/// A number as a file states it, without what the conversion of its unit rounds.
fn shown(value: f64) -> String {
    display_number((value * 1e9).round() / 1e9 + 0.0)
}

struct Tree<'a> {
    file: &'a str,
    joints: Vec<Joint<'a>>,
    /// The joint whose child is each link.
    to: BTreeMap<&'a str, usize>,
    masses: BTreeMap<&'a str, Body>,
    links: Vec<&'a str>,
    meshes: usize,
    /// Link, and where a mesh is drawn in its frame.
    visuals: Vec<(&'a str, LinkMesh)>,
}

/// A mesh of a link.
struct LinkMesh {
    origin: Pose,
    file: String,
    scale: [f64; 3],
}

/// The arm of a description.
pub(super) fn read(text: &str, file: &str, choice: &ImportOptions) -> Result<ForeignArm, RobotError> {
    if file.to_ascii_lowercase().ends_with(".xacro") {
        return Err(macros(file));
    }
    let text = with_prefixes(text);
    let document = Document::parse_with_options(&text, options()).map_err(|error| {
        let key = format!("line {}", error.pos().row);
        foreign_error(file, key, error.to_string(), "XML", "export the description again")
    })?;
    let root = document.root_element();
    if !root.has_tag_name("robot") {
        let found = format!("<{}>", root.tag_name().name());
        return Err(foreign_error(
            file,
            "root element",
            found,
            "<robot>",
            "give a URDF: SDF and MJCF are other formats",
        ));
    }
    // Definitions without use do not matter.
    let defines = |node: &Node<'_, '_>| matches!(node.tag_name().name(), "property" | "arg" | "macro");
    let is_macro =
        |node: &Node<'_, '_>| node.tag_name().namespace().is_some_and(|name| name.contains("xacro"));
    if root.children().any(|node| is_macro(&node) && !defines(&node)) {
        return Err(macros(file));
    }
    let tree = Tree::of(&root, file)?;
    let base = tree.base(choice)?;
    let path = tree.chain(base, choice)?;
    tree.foreign(&root, base, &path)
}

fn options<'a>() -> ParsingOptions<'a> {
    ParsingOptions { nodes_limit: MAX_NODES, ..ParsingOptions::default() }
}

fn macros(file: &str) -> RobotError {
    foreign_error(
        file,
        "robot",
        "xacro macros",
        "URDF, in which they are expanded",
        "expand it first: `xacro arm.urdf.xacro > arm.urdf` (ROS, or `pip install xacro`)",
    )
}

/// Most undeclared prefixes that are repaired.
const MAX_PREFIXES: usize = 16;

/// The text with its namespace prefixes declared: many tools omit that, and the marked elements are not read.
fn with_prefixes(text: &str) -> Cow<'_, str> {
    let mut text = Cow::Borrowed(text);
    for _ in 0..MAX_PREFIXES {
        let Err(roxmltree::Error::UnknownNamespace(prefix, _)) =
            Document::parse_with_options(&text, options())
        else {
            break;
        };
        let Some(at) = text.find("<robot") else { break };
        let declared = format!("<robot xmlns:{prefix}=\"{prefix}\"");
        text.to_mut().replace_range(at..at + "<robot".len(), &declared);
    }
    text
}

/// Numbers of an attribute.
fn numbers<const N: usize>(
    node: Option<Node<'_, '_>>,
    attribute: &str,
    otherwise: [f64; N],
    file: &str,
) -> Result<[f64; N], RobotError> {
    let Some((node, text)) = node.and_then(|node| Some((node, node.attribute(attribute)?))) else {
        return Ok(otherwise);
    };
    if text.contains("${") {
        return Err(macros(file));
    }
    let values: Option<Vec<f64>> =
        text.split_whitespace().map(|cell| cell.parse().ok().filter(|v: &f64| v.is_finite())).collect();
    values.and_then(|values| <[f64; N]>::try_from(values).ok()).ok_or_else(|| {
        let line = node.document().text_pos_at(node.range().start).row;
        foreign_error(
            file,
            format!("line {line}, <{} {attribute}>", node.tag_name().name()),
            format!("`{text}`"),
            if N == 1 { "a finite number" } else { "three finite numbers" },
            "correct it",
        )
    })
}

fn child<'a, 'i>(node: &Node<'a, 'i>, name: &str) -> Option<Node<'a, 'i>> {
    node.children().find(|child| child.has_tag_name(name))
}

/// The transform of an `<origin>`; the identity if there is none.
fn origin(node: &Node<'_, '_>, file: &str) -> Result<Pose, RobotError> {
    let place = child(node, "origin");
    let xyz = numbers(place, "xyz", [0.0; 3], file)?;
    let rpy = numbers(place, "rpy", [0.0; 3], file)?;
    Ok(from_rpy(Vector3::from(xyz) * 1000.0, rpy))
}

fn joint<'a>(node: &Node<'a, '_>, file: &str) -> Result<Joint<'a>, RobotError> {
    let line = node.document().text_pos_at(node.range().start).row;
    let name = node.attribute("name").unwrap_or("without a name");
    let link = |end: &str| {
        child(node, end).and_then(|end| end.attribute("link")).ok_or_else(|| {
            let key = format!("line {line}, joint {name}, <{end}>");
            foreign_error(
                file,
                key,
                "nothing",
                "the name of a link",
                "a joint leads from a parent to a child",
            )
        })
    };
    let axis = Vector3::from(numbers(child(node, "axis"), "xyz", [1.0, 0.0, 0.0], file)?);
    let type_name = node.attribute("type").unwrap_or_default();
    let mimic =
        child(node, "mimic").map(|mimic| mimic.attribute("joint").unwrap_or("another joint").to_owned());
    let kind = match (type_name, mimic) {
        ("fixed", _) => JointKind::Fixed,
        (_, Some(other)) => JointKind::Mimic(other),
        ("revolute" | "continuous", None) => JointKind::Revolute,
        ("prismatic", None) => JointKind::Prismatic,
        (other, None) => JointKind::Other(other.to_owned()),
    };
    if kind == JointKind::Revolute && !(axis.norm() > 1e-6) {
        let key = format!("line {line}, joint {name}, <axis>");
        return Err(foreign_error(
            file,
            key,
            format!("({}, {}, {})", axis.x, axis.y, axis.z),
            "a direction",
            "correct it",
        ));
    }
    let limit = child(node, "limit");
    let bounded = type_name == "revolute"
        && limit.is_some_and(|limit| limit.has_attribute("lower") || limit.has_attribute("upper"));
    let limits_rad = if bounded {
        let [low] = numbers(limit, "lower", [0.0], file)?;
        let [high] = numbers(limit, "upper", [0.0], file)?;
        Some([low, high])
    } else {
        None
    };
    let [speed] = numbers(limit, "velocity", [0.0], file)?;
    Ok(Joint {
        name,
        parent: link("parent")?,
        child: link("child")?,
        before: origin(node, file)?,
        axis,
        kind,
        limits_rad,
        speed_rad_s: (speed > 0.0).then_some(speed),
        line,
    })
}

/// Mass and centre of a link, in the link's own frame.
fn body(node: &Node<'_, '_>, file: &str) -> Result<Option<Body>, RobotError> {
    let Some(inertial) = child(node, "inertial") else { return Ok(None) };
    let [mass_kg] = numbers(child(&inertial, "mass"), "value", [0.0], file)?;
    if mass_kg < 0.0 {
        let name = node.attribute("name").unwrap_or("without a name");
        let line = node.document().text_pos_at(inertial.range().start).row;
        return Err(foreign_error(
            file,
            format!("line {line}, link {name}, <mass>"),
            display_number(mass_kg),
            "a mass in kg, 0 or more",
            "correct it",
        ));
    }
    let centre = origin(&inertial, file)?.translation.vector;
    Ok((mass_kg > 0.0).then(|| Body { mass_kg, centre_mm: centre.into() }))
}

/// The meshes for drawing a link: those of `<visual>`, or those of `<collision>` where only these are STL.
fn shown_by(link: &Node<'_, '_>, file: &str) -> Result<Vec<LinkMesh>, RobotError> {
    let of = |tag: &str| -> Result<Vec<LinkMesh>, RobotError> {
        let parts = link.children().filter(|inner| inner.has_tag_name(tag));
        parts.filter_map(|part| drawn(&part, file).transpose()).collect()
    };
    let is_stl = |mesh: &LinkMesh| mesh.file.to_ascii_lowercase().ends_with(".stl");
    let visual = of("visual")?;
    if visual.is_empty() || visual.iter().any(is_stl) {
        return Ok(visual);
    }
    let collision = of("collision")?;
    Ok(if collision.iter().any(is_stl) { collision } else { visual })
}

/// The mesh of a `<visual>` or `<collision>`; boxes, cylinders and spheres are not read.
fn drawn(visual: &Node<'_, '_>, file: &str) -> Result<Option<LinkMesh>, RobotError> {
    let mesh = child(visual, "geometry").and_then(|geometry| child(&geometry, "mesh"));
    let Some(name) = mesh.and_then(|mesh| mesh.attribute("filename")) else { return Ok(None) };
    let scale = numbers(mesh, "scale", [1.0; 3], file)?;
    Ok(Some(LinkMesh { origin: origin(visual, file)?, file: name.to_owned(), scale }))
}

impl<'a> Tree<'a> {
    fn of(root: &Node<'a, '_>, file: &'a str) -> Result<Self, RobotError> {
        let mut tree = Self {
            file,
            joints: Vec::new(),
            to: BTreeMap::new(),
            masses: BTreeMap::new(),
            links: Vec::new(),
            meshes: 0,
            visuals: Vec::new(),
        };
        let mut names = BTreeSet::new();
        for node in root.children().filter(Node::is_element) {
            match node.tag_name().name() {
                "link" => {
                    let name = node.attribute("name").unwrap_or_default();
                    if !names.insert(name) {
                        let line = node.document().text_pos_at(node.range().start).row;
                        return Err(foreign_error(
                            file,
                            format!("line {line}, link {name}"),
                            "a second link of this name",
                            "a name of its own for each link",
                            "rename or take out one of the two",
                        ));
                    }
                    tree.links.push(name);
                    if let Some(body) = body(&node, file)? {
                        tree.masses.insert(name, body);
                    }
                    tree.visuals.extend(shown_by(&node, file)?.into_iter().map(|drawn| (name, drawn)));
                    tree.meshes += node.descendants().filter(|inner| inner.has_tag_name("mesh")).count();
                }
                // The joints of a transmission are no joints of the tree.
                "joint" => {
                    let joint = joint(&node, file)?;
                    if let Some(first) = tree.to.insert(joint.child, tree.joints.len()) {
                        let first: &Joint<'_> = &tree.joints[first];
                        return Err(foreign_error(
                            file,
                            format!("line {}, joint {}", joint.line, joint.name),
                            format!(
                                "link {} as its child, which is that of joint {} already",
                                joint.child, first.name
                            ),
                            "a tree: one joint that leads to each link",
                            "take one of the two out",
                        ));
                    }
                    tree.joints.push(joint);
                }
                _ => {}
            }
        }
        Ok(tree)
    }

    /// The base link of the arm.
    fn base(&self, choice: &ImportOptions) -> Result<&'a str, RobotError> {
        if let Some(base) = &choice.base {
            return self.named(base, "base");
        }
        let mut roots: Vec<&str> =
            self.joints.iter().map(|joint| joint.parent).filter(|link| !self.to.contains_key(link)).collect();
        roots.sort_unstable();
        roots.dedup();
        match roots.as_slice() {
            [root] => Ok(root),
            [] => Err(foreign_error(
                self.file,
                "joints",
                "no link without a parent",
                "one root",
                "a tree begins at a link that is not a child",
            )),
            several => Err(foreign_error(
                self.file,
                "links",
                format!("{} links without a parent: {}", several.len(), several.join(", ")),
                "one root",
                "say which one is the base (--base)",
            )),
        }
    }

    fn named(&self, name: &str, which: &str) -> Result<&'a str, RobotError> {
        let found = self.links.iter().copied().chain(self.to.keys().copied()).find(|link| *link == name);
        found.ok_or_else(|| {
            let mut known: Vec<&str> = self.links.clone();
            known.truncate(40);
            foreign_error(
                self.file,
                which,
                format!("`{name}`; the links are {}", known.join(", ")),
                "the name of a link",
                "give a name as the file has it",
            )
        })
    }

    /// The joints from a base to a tip; `None` where the tip is not below the base.
    fn path(&self, base: &str, tip: &str) -> Option<Vec<usize>> {
        let mut out = Vec::new();
        let mut at = tip;
        while at != base {
            let joint = *self.to.get(at)?;
            out.push(joint);
            at = self.joints[joint].parent;
            // A cycle has no root.
            if out.len() > self.joints.len() {
                return None;
            }
        }
        out.reverse();
        Some(out)
    }

    fn moving(&self, path: &[usize]) -> Vec<usize> {
        path.iter().copied().filter(|joint| self.joints[*joint].is_moving()).collect()
    }

    fn names(&self, joints: &[usize]) -> String {
        joints.iter().map(|joint| self.joints[*joint].name).collect::<Vec<_>>().join(", ")
    }

    /// The joints of the arm, from base to flange.
    fn chain(&self, base: &'a str, choice: &ImportOptions) -> Result<Vec<usize>, RobotError> {
        if let Some(tip) = &choice.tip {
            let tip = self.named(tip, "tip")?;
            let path = self.path(base, tip).ok_or_else(|| {
                let found = format!("link {tip}, to which no joints lead from {base}");
                foreign_error(
                    self.file,
                    "tip",
                    found,
                    "a link after the base",
                    "give base and tip of one arm",
                )
            })?;
            self.six(&path)?;
            return Ok(path);
        }
        if let Some(path) = self.to_flange(base)? {
            return Ok(path);
        }
        let (ends, longest) = self.ends(base);
        match ends.as_slice() {
            [end] => self.tip_behind(base, *end),
            [] => Err(self.not_six(&longest)),
            several => Err(self.several(several)),
        }
    }

    /// The joints to the flange, where a link has the name of one; joints after it belong to a gripper.
    fn to_flange(&self, base: &'a str) -> Result<Option<Vec<usize>>, RobotError> {
        let named = |link: &str, name: &str| {
            link.strip_suffix(name).is_some_and(|rest| rest.is_empty() || rest.ends_with(['_', '-', '/']))
        };
        for name in FLANGES {
            let paths: Vec<Vec<usize>> = self
                .to
                .keys()
                .filter(|link| named(link, name))
                .filter_map(|link| self.path(base, link))
                .collect();
            let arms: Vec<&Vec<usize>> = paths.iter().filter(|path| self.moving(path).len() == 6).collect();
            match arms.as_slice() {
                [path] => return self.six(path).map(|_| Some((*path).clone())),
                [] => {
                    // The flange of another kind of arm.
                    if let Some(path) = paths.iter().max_by_key(|path| self.moving(path).len())
                        && !self.moving(path).is_empty()
                    {
                        return Err(self.not_six(&self.moving(path)));
                    }
                }
                several => {
                    let ends: Vec<usize> =
                        several.iter().filter_map(|path| self.moving(path).pop()).collect();
                    return Err(self.several(&ends));
                }
            }
        }
        Ok(None)
    }

    /// The last joint of every chain of exactly six joints that no longer chain contains, and the longest chain.
    fn ends(&self, base: &str) -> (Vec<usize>, Vec<usize>) {
        let parents: Vec<&str> = self.joints.iter().map(|joint| joint.parent).collect();
        let leaves = self.to.keys().filter(|link| !parents.contains(link));
        let chains: Vec<Vec<usize>> =
            leaves.filter_map(|leaf| self.path(base, leaf)).map(|path| self.moving(&path)).collect();
        let mut ends: Vec<usize> = chains
            .iter()
            .filter(|chain| chain.len() == 6)
            .filter_map(|chain| chain.last().copied())
            .collect();
        ends.sort_unstable();
        ends.dedup();
        ends.retain(|end| !chains.iter().any(|chain| chain.len() > 6 && chain.contains(end)));
        (ends, chains.into_iter().max_by_key(Vec::len).unwrap_or_default())
    }

    fn several(&self, ends: &[usize]) -> RobotError {
        foreign_error(
            self.file,
            "joints",
            format!("{} arms of six joints, which end with {}", ends.len(), self.names(ends)),
            "one arm",
            "say which one by its first and last link, --base LINK --tip LINK; `truegrind robots --check FILE` with them shows it, and \
             writes its robot file with -o arm.toml",
        )
    }

    fn not_six(&self, moving: &[usize]) -> RobotError {
        let found = format!("{} joints that move in a row: {}", moving.len(), self.names(moving));
        foreign_error(
            self.file,
            "joints",
            found,
            "six joints that turn",
            "truegrind supports arms with six rotary axes; where a gripper or a track is among them, --base and --tip say where the arm begins and \
             ends",
        )
    }

    /// Refuses a path that is not six joints that turn.
    fn six(&self, path: &[usize]) -> Result<Vec<usize>, RobotError> {
        let moving = self.moving(path);
        for joint in moving.iter().map(|joint| &self.joints[*joint]) {
            let found = match &joint.kind {
                JointKind::Fixed | JointKind::Revolute => continue,
                JointKind::Prismatic => "a joint that slides (prismatic)".to_owned(),
                JointKind::Mimic(other) => format!("a joint that follows {other} (mimic)"),
                JointKind::Other(kind) => format!("a joint of type `{kind}`"),
            };
            return Err(foreign_error(
                self.file,
                format!("line {}, joint {}", joint.line, joint.name),
                found,
                "six joints that turn on their own, and fixed ones",
                "say by --base and --tip which six; an arm whose links couple joints is given as a table with columns q1 to q6",
            ));
        }
        if moving.len() == 6 { Ok(moving) } else { Err(self.not_six(&moving)) }
    }

    /// The path to the flange after the sixth joint.
    fn tip_behind(&self, base: &'a str, end: usize) -> Result<Vec<usize>, RobotError> {
        let behind: Vec<&str> = self
            .links_behind(end)
            .into_iter()
            .filter(|link| self.path(base, link).is_some_and(|path| self.moving(&path).last() == Some(&end)))
            .collect();
        let tip = match behind.as_slice() {
            [only] => only,
            several => {
                return Err(foreign_error(
                    self.file,
                    "flange",
                    format!(
                        "{} links after joint {}: {}",
                        several.len(),
                        self.joints[end].name,
                        several.join(", ")
                    ),
                    "one that is tool0 or flange",
                    "say which one by --tip",
                ));
            }
        };
        let path = self.path(base, tip).unwrap_or_default();
        self.six(&path)?;
        Ok(path)
    }

    /// The child of a joint and all its descendants.
    fn links_behind(&self, joint: usize) -> Vec<&'a str> {
        let mut out = vec![self.joints[joint].child];
        let mut at = 0;
        while let Some(link) = out.get(at).copied() {
            out.extend(self.joints.iter().filter(|joint| joint.parent == link).map(|joint| joint.child));
            at += 1;
            if out.len() > self.joints.len() + 1 {
                break;
            }
        }
        out
    }

    fn foreign(&self, root: &Node<'_, '_>, base: &str, path: &[usize]) -> Result<ForeignArm, RobotError> {
        let moving = self.six(path)?;
        let mut before = Pose::identity();
        let mut steps: Vec<Step> = Vec::new();
        for joint in path.iter().map(|joint| &self.joints[*joint]) {
            before *= joint.before;
            if joint.is_moving() {
                steps.push(Step { before, axis: UnitVector3::new_normalize(joint.axis) });
                before = Pose::identity();
            }
        }
        let steps: [Step; 6] = steps.try_into().map_err(|_| self.not_six(&moving))?;
        let six: [&Joint<'_>; 6] = std::array::from_fn(|i| &self.joints[moving[i]]);
        let tip = path.last().map_or(base, |joint| self.joints[*joint].child);
        let robot = root.attribute("name").unwrap_or_default();
        let (dialect, maker) = maker_of(&format!("{robot} {}", self.file));
        let mut notes =
            vec![format!("joints 1 to 6 are {}; from link {base} to link {tip}", self.names(&moving))];
        notes.extend(self.above_base(base));
        for joint in path.iter().map(|joint| &self.joints[*joint]) {
            joint.check_length(self.file)?;
        }
        for joint in six {
            joint.check_limits(self.file)?;
        }
        let limits = six.map(|joint| joint.limits_rad);
        let unlimited: Vec<&str> =
            six.iter().filter(|joint| joint.limits_rad.is_none()).map(|joint| joint.name).collect();
        let limits_deg = limits
            .iter()
            .any(Option::is_some)
            .then(|| limits.map(|range| range.map_or([-360.0, 360.0], |range| range.map(f64::to_degrees))));
        if limits_deg.is_some() && !unlimited.is_empty() {
            notes.push(format!(
                "no range is stated of {}: one turn in each direction is assumed",
                unlimited.join(", ")
            ));
        }
        let speeds = six.map(|joint| joint.speed_rad_s);
        let masses = self.masses(base, &moving);
        notes.push(match &masses {
            Some(masses) => {
                format!(
                    "masses are used: {:.1} kg in the six moving links",
                    masses.iter().map(|body| body.mass_kg).sum::<f64>()
                )
            }
            None => "not every link states a mass, so no masses are used".to_owned(),
        });
        if self.meshes > 0 {
            notes.push(format!(
                "{} meshes are named; recordings draw those of the links that are STL, nothing is computed from them",
                self.meshes
            ));
        }
        if maker == "FANUC" {
            notes.push(
                "FANUC controllers measure joint 3 relative to the ground, URDF files relative to link 2: if the log is from the controller, give \
                 --ground-joint-3"
                    .to_owned(),
            );
        }
        Ok(ForeignArm {
            steps,
            after: before,
            gravity: self.gravity(base),
            limits_deg,
            speed_deg_s: speeds
                .iter()
                .all(Option::is_some)
                .then(|| speeds.map(|speed| speed.unwrap_or_default().to_degrees())),
            joint_map: None,
            masses,
            maker: maker.to_owned(),
            designation: robot.to_owned(),
            dialect,
            source: format!("{}, URDF, links {base} to {tip}", self.file),
            visuals: self.shown(base, &moving),
            notes,
        })
    }

    /// The joints above a link, the nearest first.
    fn above(&self, link: &str) -> Vec<&Joint<'a>> {
        let mut out: Vec<&Joint<'a>> = Vec::new();
        let mut at = link;
        while let Some(joint) = self.to.get(at).map(|joint| &self.joints[*joint]) {
            out.push(joint);
            at = joint.parent;
            // A cycle has no root.
            if out.len() > self.joints.len() {
                break;
            }
        }
        out
    }

    /// Direction of gravity in a link: along −z of the root of the tree, with the joints above the link at zero.
    fn gravity(&self, link: &str) -> Vector3<f64> {
        let down = -Vector3::z();
        self.above(link).iter().rev().fold(down, |down, joint| joint.before.rotation.inverse() * down)
    }

    /// Notes on what is above a base that is not the root.
    fn above_base(&self, base: &str) -> Option<String> {
        let above = self.above(base);
        let root = above.last()?.parent;
        let moving: Vec<&str> =
            above.iter().filter(|joint| joint.is_moving()).map(|joint| joint.name).collect();
        let at_zero = match moving.as_slice() {
            [] => String::new(),
            moving => format!(", with {} at zero", moving.join(", ")),
        };
        Some(format!("gravity points along −z of link {root}, the root of the tree{at_zero}"))
    }

    /// The meshes of the arm's links and of links fixed to them.
    fn shown(&self, base: &str, moving: &[usize]) -> Vec<Mesh> {
        let shown = |(link, drawn): &(&str, LinkMesh)| {
            let path = self.path(base, link)?;
            let own = self.moving(&path);
            // Links after a gripper joint do not belong to the arm.
            if !moving.starts_with(&own) {
                return None;
            }
            let frame = path.iter().fold(Pose::identity(), |pose, joint| pose * self.joints[*joint].before);
            Some(Mesh {
                joints: own.len(),
                place: frame * drawn.origin,
                file: drawn.file.clone(),
                unit_mm: drawn.scale.map(|scale| 1000.0 * scale),
            })
        };
        self.visuals.iter().filter_map(shown).collect()
    }

    /// Mass of each joint's link and the links fixed to it. `None` where one has no mass.
    fn masses(&self, base: &str, moving: &[usize]) -> Option<[Body; 6]> {
        let mut out = [Body { mass_kg: 0.0, centre_mm: [0.0; 3] }; 6];
        for (link, body) in &self.masses {
            let Some(path) = self.path(base, link) else { continue };
            let own = self.moving(&path);
            // Links after a gripper joint do not belong to the arm.
            let Some(place) = moving.iter().position(|joint| own.last() == Some(joint)) else { continue };
            let frame = path.iter().fold(Pose::identity(), |pose, joint| pose * self.joints[*joint].before);
            let centre = frame * Point3::from(body.centre_mm);
            let whole = &mut out[place];
            let mass = whole.mass_kg + body.mass_kg;
            for k in 0..3 {
                whole.centre_mm[k] = (whole.mass_kg * whole.centre_mm[k] + body.mass_kg * centre[k]) / mass;
            }
            whole.mass_kg = mass;
        }
        out.iter().all(|body| body.mass_kg > 0.0).then_some(out)
    }
}
