//! The robot file as text, with words on what was seen, what was guessed, and what is left to do.

use std::fmt::Write;

use super::DraftShape;
use cft_ident_core::number;
use cft_ident_core::robot::JointKind;
use cft_ident_files::config::{DeclaredCapsules, UrdfChain};
use cft_ident_logs::log::{escape, list};
use cft_ident_logs::mapping::{ClockSource, JointColumns, Mapping, SeenColumns};

/// What a draft is written from.
pub(super) struct DraftInputs<'a> {
    pub name: String,
    pub shape: DraftShape,
    pub mapping: &'a Mapping,
    pub seen: Option<&'a SeenColumns>,
    pub chain: Option<&'a UrdfChain>,
    /// About the collision shapes of the URDF.
    pub capsules: DeclaredCapsules,
    /// Pairs of links whose capsules overlap in every pose.
    pub touching: Vec<[String; 2]>,
}

/// A text in quotes, as TOML holds it.
fn quoted(text: &str) -> String {
    toml::Value::from(text).to_string()
}

/// A key, in quotes where it must be.
fn key(text: &str) -> String {
    let bare = |c: char| c.is_ascii_alphanumeric() || c == '_' || c == '-';
    match text.chars().all(bare) {
        true => text.to_owned(),
        false => quoted(text),
    }
}

impl DraftInputs<'_> {
    /// `[robot] model`.
    pub(super) fn model(&self) -> &'static str {
        match self.shape {
            DraftShape::Single(_) => "single-joint",
            DraftShape::Urdf { .. } | DraftShape::Rows => "serial",
        }
    }

    /// Cut-off of the parallel filter: some twelve samples a period, and 20 Hz, above which no arm follows.
    pub(super) fn cutoff_hz(&self) -> Option<f64> {
        let rate = self.seen.and_then(|s| s.rate_hz)?;
        Some((rate / 12.5).min(20.0))
    }

    pub(super) fn text(&self) -> String {
        let mut out = format!(
            "# {}: a robot file of cft-ident. SI units and radians.\n",
            self.name
        );
        if let Some(seen) = self.seen {
            let rate = seen.rate_hz.map_or("an unknown rate".to_owned(), |rate| {
                format!("{} Hz", number::significant(rate, 4))
            });
            let _ = writeln!(
                out,
                "# Seen in {}: {} columns, {} s at {rate}.",
                seen.name,
                seen.columns.len(),
                number::significant(seen.duration_s, 4)
            );
        }
        self.robot(&mut out);
        out.push_str(
            "\n# Friction and a constant torque per joint are fitted with the inertias, in one step. With logs of\n\
             # one joint at a time, `law = \"double-tanh\"` and `cft-ident friction` tell friction more exactly.\n\
             [friction]\n\
             law = \"viscous-coulomb\"\n\
             fitted_with_inertias = true\n\
             offset = true\n",
        );
        self.log(&mut out);
        self.filter(&mut out);
        out.push_str(
            "\n# Limits are used by `inspect`, `excite` and `simulate`; those of a URDF need not be repeated. It gives no accelerations:\n\
             # where none stands here, the next motion of `excite` keeps to those of the logs.\n",
        );
        self.places(&mut out);
        if let Some(joint) = self.mapping.joints.first() {
            let _ = write!(
                out,
                "# [limits.{}]\n# position = [-1.0, 1.0]\n# speed = 1.0\n# acceleration = 5.0\n# torque = 10.0\n",
                key(&joint.joint)
            );
        }
        out
    }

    /// Capsules about the collision shapes of the URDF, and how to bound points.
    fn places(&self, out: &mut String) {
        let Some(chain) = self.chain else { return };
        out.push_str(
            "# A floor, and a box in the frame of the base, for points of links: `excite` keeps them along a motion.\n\
             # [limits]\n# floor = 0.05\n# box = [[-1.0, -1.0, 0.0], [1.0, 1.0, 1.5]]\n# [[limits.point]]\n\
             # name = \"flange\"\n",
        );
        if let Some(name) = chain.links.last().and_then(|link| link.name.as_deref()) {
            let _ = writeln!(out, "# link = {}\n# xyz = [0.0, 0.0, 0.1]", quoted(name));
        }
        let DeclaredCapsules {
            sections, without, ..
        } = &self.capsules;
        if !without.is_empty() {
            let _ = writeln!(
                out,
                "# CHECK IT: not all collision shapes of {} could be read; give [[limits.capsule]] tables: link, from, to, radius.",
                escape(&list(without.iter().map(String::as_str)))
            );
        }
        if sections.is_empty() {
            return;
        }
        out.push_str(
            "\n# Capsules that hold the collision shapes of the URDF. Those of links that are no neighbours keep apart.\n",
        );
        if !self.touching.is_empty() {
            let pair = |[one, other]: &[String; 2]| format!("[{}, {}]", quoted(one), quoted(other));
            let pairs: Vec<String> = self.touching.iter().map(pair).collect();
            let _ = writeln!(
                out,
                "[limits]\n# They overlap in every pose that was tried.\ntouching = [{}]",
                pairs.join(", ")
            );
        }
        for capsule in sections {
            let rounded = |x: [f64; 3]| x.map(|x| (x * 1e6).round() / 1e6 + 0.0);
            let _ = writeln!(
                out,
                "\n[[limits.capsule]]\nlink = {}\nfrom = {:?}\nto = {:?}\nradius = {:?}",
                quoted(&capsule.link),
                rounded(capsule.from),
                rounded(capsule.to),
                capsule.radius
            );
        }
        out.push('\n');
    }

    fn robot(&self, out: &mut String) {
        let _ = writeln!(out, "\n[robot]\nmodel = {}", quoted(self.model()));
        let serial = "# gravity = [0.0, 0.0, -9.81]   # free fall in the frame of the base; turn it where the base is tilted\n\
                      # drive_inertia = false         # where torques are measured behind the gears, on the link side\n";
        match &self.shape {
            DraftShape::Urdf { path, tip, held } => {
                let _ = writeln!(
                    out,
                    "urdf = {}   # from the folder of this file",
                    quoted(path)
                );
                out.push_str(&match tip {
                    Some(tip) => format!("tip = {}\n", quoted(tip)),
                    None => "# tip = \"tool0\"               # link where the chain ends, where the URDF branches\n".to_owned(),
                });
                let each = held
                    .iter()
                    .map(|(joint, at)| format!("{} = {at:?}", key(joint)));
                let each: Vec<String> = each.collect();
                if !each.is_empty() {
                    let _ = writeln!(
                        out,
                        "held = {{ {} }}   # CHECK IT: joints without columns, and where they stand still [rad or m]",
                        each.join(", ")
                    );
                }
                out.push_str(serial);
            }
            DraftShape::Single(kind) => {
                let first = self.mapping.joints.first();
                let name = first.map_or("q1", |j| j.joint.as_str());
                let (kind, why) = match kind {
                    JointKind::Prismatic => (
                        "prismatic",
                        "by its unit or its name; revolute where it turns",
                    ),
                    JointKind::Revolute => ("revolute", "guessed; prismatic where it slides"),
                };
                let _ = writeln!(
                    out,
                    "joint = {}\nkind = {}   # {why}",
                    quoted(name),
                    quoted(kind)
                );
            }
            DraftShape::Rows => {
                out.push_str(serial);
                out.push_str(
                    "\n# TO BE FILLED IN: a row of the modified Denavit-Hartenberg table (Craig) for each joint: alpha and\n\
                     # a of the link before it, then d and the angle theta at q = 0; 0.0 where it is zero. Until then no\n\
                     # command reads this file. A URDF does it too: urdf = \"FILE\" above, and none of these rows.\n",
                );
                for joint in &self.mapping.joints {
                    let kind = match joint.kind {
                        JointKind::Prismatic => "kind = \"prismatic\"\n",
                        JointKind::Revolute => "",
                    };
                    let _ = write!(
                        out,
                        "\n[[robot.link]]\njoint = {}\n{kind}a = nan         # m\nalpha = nan     # rad\nd = nan         # m\ntheta = nan     # rad\n",
                        quoted(&joint.joint)
                    );
                }
            }
        }
    }

    fn log(&self, out: &mut String) {
        out.push_str("\n[log]\n");
        if let Some(seen) = self.seen {
            self.clock(seen, out);
        }
        let what = self.mapping.torque_is;
        let check = self.mapping.torque_check.as_ref();
        let check = check.map_or(String::new(), |text| format!("CHECK IT: {text}. "));
        let _ = writeln!(
            out,
            "torque_is = {:<12} # {check}\"joint\", \"motor\", \"current\" or \"commanded\"\n\
             torque_held = false     # true where a torque was held from its own row to the next",
            quoted(what)
        );
        if self.seen.is_none() {
            out.push_str(
                "# Columns are t, q_<joint>, tau_<joint> and, where there are some, dq_<joint>. Others are mapped so:\n\
                 # [log.joint]\n",
            );
            if let Some(joint) = self.mapping.joints.first() {
                let _ = writeln!(
                    out,
                    "# {} = {{ position = \"pos 1\", torque = \"I 1\", torque_unit = \"A\", torque_scale = 12.5 }}",
                    key(&joint.joint)
                );
            }
            return;
        }
        let recording = self.seen.is_some_and(SeenColumns::is_recording);
        let joints = self.mapping.joints.iter();
        let lines: Vec<String> = joints.filter_map(|j| columns(j, recording)).collect();
        for check in &self.mapping.checks {
            let _ = writeln!(out, "# CHECK IT: {check}.");
        }
        if !self.mapping.others.is_empty() {
            let others = self.mapping.others.join(", ");
            let _ = writeln!(out, "# Others of the kind: {others}.");
        }
        self.temperatures(out);
        self.offered(out);
        let whole = |j: &JointColumns| j.position.is_some() && j.torque.is_some();
        if lines.is_empty() && self.mapping.joints.iter().all(whole) {
            out.push_str(
                "# The log has the tool's own names for its columns: nothing is to be mapped.\n",
            );
        }
        if lines.is_empty() {
            return;
        }
        let _ = write!(
            out,
            "\n# Columns of each joint, {}.\n\
             # More keys: position_unit, position_sign, position_scale, position_offset,\n\
             # torque_unit, torque_sign, torque_scale (gear ratio times torque constant), torque_wrap.\n[log.joint]\n",
            self.mapping.how
        );
        lines.iter().for_each(|line| *out += &format!("{line}\n"));
    }

    /// Columns that nothing was found for, by the names that they share.
    fn offered(&self, out: &mut String) {
        if self.mapping.offered.is_empty() {
            return;
        }
        let families = self.mapping.offered.iter().map(|name| escape(name));
        let _ = writeln!(
            out,
            "# CHECK IT: no names say which columns are the {}. Columns of which there are as many: {}. Write them\n\
             # as position = .. and torque = .. of each joint in [log.joint].",
            self.mapping.lacking.join(" and "),
            families.collect::<Vec<_>>().join(", ")
        );
    }

    /// Columns that may be the temperatures of the drives: a guess by their names, which nothing reads unasked.
    fn temperatures(&self, out: &mut String) {
        let joints = self.mapping.joints.iter();
        let found = joints.filter_map(|joint| Some((joint, joint.temperature.as_ref()?)));
        let lines = found.map(|(joint, name)| {
            let (joint, column) = (key(&joint.joint), column(name));
            format!("#   {joint}: temperature = {column}\n")
        });
        let lines: String = lines.collect();
        if !lines.is_empty() {
            out.push_str(
                "# CHECK IT: temperatures of the drives? This key in the line of each joint in [log.joint] makes them signals:\n",
            );
            out.push_str(&lines);
        }
    }

    /// Where the times come from, and which topic of a recording is read.
    fn clock(&self, seen: &SeenColumns, out: &mut String) {
        match &seen.clock {
            ClockSource::Messages => {
                if let Some(hz) = seen.even_hz {
                    let _ = writeln!(
                        out,
                        "rate_hz = {hz:?}   # CHECK IT: messages were sampled evenly, as their positions show; their stamps are not when"
                    );
                }
            }
            ClockSource::Rate { hz, coarse: None } => {
                let _ = writeln!(out, "rate_hz = {hz:?}   # the log has no times");
            }
            ClockSource::Rate {
                hz,
                coarse: Some(name),
            } => {
                let _ = writeln!(
                    out,
                    "rate_hz = {hz:?}   # CHECK IT: rows lie evenly? the clock of {} is too coarse for them",
                    escape(name)
                );
            }
            ClockSource::Column {
                name,
                seconds,
                guessed,
            } => {
                let guessed = match guessed {
                    true => "   # CHECK IT: it runs evenly, as times do",
                    false => "",
                };
                if name != "t" || !guessed.is_empty() {
                    let _ = writeln!(out, "time = {}{guessed}", column(name));
                }
                let mut units = [
                    ("ms", 1e-3),
                    ("us", 1e-6),
                    ("ns", 1e-9),
                    ("min", 60.0),
                    ("h", 3600.0),
                    ("d", 86_400.0),
                ]
                .into_iter();
                if let Some((unit, _)) = units.find(|(_, size)| size == seconds) {
                    let _ = writeln!(out, "time_unit = {}", quoted(unit));
                }
            }
        }
        if let Some(topic) = &seen.topic {
            let _ = writeln!(out, "topic = {}", quoted(topic));
            if !seen.other_topics.is_empty() {
                let others: Vec<String> = seen.other_topics.iter().map(|t| escape(t)).collect();
                let others = others.join(", ");
                let _ = writeln!(out, "# Other machines in the recording: {others}.");
            }
        }
    }

    fn filter(&self, out: &mut String) {
        out.push_str("\n[filter]\n");
        match (self.cutoff_hz(), self.seen.and_then(|s| s.rate_hz)) {
            (Some(cutoff), Some(rate)) => {
                let _ = write!(
                    out,
                    "# From the rate of the log, {} Hz. Torque and all columns of the model pass the same filter; a\n\
                     # lower cut-off makes every error look smaller, so choose it once and keep it.\n\
                     cutoff_hz = {:?}\n",
                    number::significant(rate, 4),
                    (cutoff * 10.0).round() / 10.0
                );
            }
            _ => out.push_str(
                "# cutoff_hz = 10.0   # of torque and all columns; some twelve samples a period\n",
            ),
        }
        out.push_str(
            "# position_cutoff_hz = 60.0   # of the positions before they are differentiated; found from the logs if left out\n",
        );
    }
}

/// A column as TOML names it: in quotes, or by its number.
fn column(name: &str) -> String {
    match name.strip_prefix('#').and_then(|n| n.parse::<u32>().ok()) {
        Some(number) => number.to_string(),
        None => quoted(name),
    }
}

/// The line of a joint in `[log.joint]`, where its columns have names or units of their own.
fn columns(joint: &JointColumns, recording: bool) -> Option<String> {
    let mut keys = Vec::new();
    // messages hold the arrays of all joints: what is named there is the joint
    if let Some(name) = &joint.in_messages {
        keys.push(format!("name = {}", quoted(name)));
    }
    for (what, found, plain) in [
        ("position", &joint.position, "q_"),
        ("velocity", &joint.velocity, "dq_"),
        ("torque", &joint.torque, "tau_"),
    ] {
        if let Some(found) = found
            && (!recording || joint.by_path)
            && *found != format!("{plain}{}", joint.joint)
        {
            keys.push(format!("{what} = {}", column(found)));
        }
    }
    let number = |x: f64| format!("{x:?}");
    let values = [
        ("position_unit", joint.position_unit.map(quoted)),
        ("position_scale", joint.position_scale.map(number)),
        ("position_offset", joint.position_offset.map(number)),
        ("wrap", joint.wrap.map(number)),
        ("torque_unit", joint.torque_unit.map(quoted)),
        ("torque_scale", joint.torque_scale.map(number)),
        ("torque_wrap", joint.torque_wrap.map(number)),
    ];
    let given = values
        .into_iter()
        .filter_map(|(key, value)| Some((key, value?)));
    keys.extend(given.map(|(key, value)| format!("{key} = {value}")));
    (!keys.is_empty()).then(|| format!("{} = {{ {} }}", key(&joint.joint), keys.join(", ")))
}
