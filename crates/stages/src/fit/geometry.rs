//! Which angle or length of a serial robot makes a base parameter that no motion can determine: one that is
//! nearly, and not quite, that of parallel, crossing or square axes.

use std::f64::consts::PI;

use crate::input::robot_setup::RobotSetup;
use crate::input::unknowns::FittedUnknown;
use crate::setup::{Finding, FindingKind, Setting};
use cft_ident_core::verdict::Verdict;
use cft_ident_files::config::RobotFile;
use cft_ident_files::config::robot_file::ModelKind;
use cft_ident_files::config::serial_section::LinkSection;

/// Normalised condition number from which a fit has a direction that its rows hardly determine.
const MAX_CONDITION: f64 = 1e4;
/// Nearness to a multiple of pi/12 \[rad\], and to 0 \[m\]: what calibrations correct by, and rounding.
const ROUNDING: [f64; 2] = [0.02, 2e-3];

/// A number of a link that is nearly a plain one.
struct NearRoundNumber {
    link: usize,
    key: &'static str,
    /// Place in a vector; 0 for a number alone.
    part: usize,
    declared: f64,
    plain: f64,
}

impl NearRoundNumber {
    fn of(link: usize, key: &'static str, part: usize, declared: f64) -> Option<Self> {
        let angle = matches!(key, "alpha" | "theta" | "rpy");
        let (plain, near) = match angle {
            true => ((declared / PI * 12.0).round() * PI / 12.0, ROUNDING[0]),
            false => (0.0, ROUNDING[1]),
        };
        let off = (declared - plain).abs();
        (off > 1e-9 && off < near).then_some(Self {
            link,
            key,
            part,
            declared,
            plain,
        })
    }

    fn put(&self, links: &mut [LinkSection]) {
        let link = &mut links[self.link];
        let place = match self.key {
            "a" => link.a.as_mut(),
            "alpha" => link.alpha.as_mut(),
            "d" => link.d.as_mut(),
            "theta" => link.theta.as_mut(),
            "xyz" => link.xyz.as_mut().map(|v| &mut v[self.part]),
            _ => link.rpy.as_mut().map(|v| &mut v[self.part]),
        };
        if let Some(place) = place {
            *place = self.plain;
        }
    }

    /// With it made plain `fewer` parameters would be left; `largest` is the one that is least determined, in words.
    fn finding(&self, file: &RobotFile, fewer: usize, largest: &str) -> Finding {
        let joint = file.robot.link[self.link].joint.clone();
        let name = joint.clone();
        let name = name.unwrap_or_else(|| format!("link {}", self.link + 1));
        let place = match self.key {
            "xyz" | "rpy" => format!("{}[{}]", self.key, self.part),
            key => key.to_owned(),
        };
        let (value, exact) = (self.declared, self.plain);
        Finding::new(
            FindingKind::Geometry,
            joint,
            [Setting::Number(value), Setting::Number(exact)],
            format!(
                "{place} of {name} is {value}, which is {:.1e} from {exact:.9}: with that {fewer} base parameter(s) fewer would be left, which these data cannot tell{largest}",
                (value - exact).abs(),
            ),
            format!(
                "{place} = {exact:?} in the row of {name} of the robot file or its URDF, unless it was measured so"
            ),
            false,
        )
    }
}

fn all_nearly(links: &[LinkSection]) -> Vec<NearRoundNumber> {
    let mut out = Vec::new();
    for (i, link) in links.iter().enumerate() {
        for (key, value) in [
            ("a", link.a),
            ("alpha", link.alpha),
            ("d", link.d),
            ("theta", link.theta),
        ] {
            out.extend(value.and_then(|value| NearRoundNumber::of(i, key, 0, value)));
        }
        for (key, vector) in [("xyz", link.xyz), ("rpy", link.rpy)] {
            let parts = vector.into_iter().flatten().enumerate();
            out.extend(parts.filter_map(|(part, value)| NearRoundNumber::of(i, key, part, value)));
        }
    }
    out
}

/// Number of base parameters of a robot with these numbers made plain.
fn parameters<'n>(file: &RobotFile, plain: impl Iterator<Item = &'n NearRoundNumber>) -> usize {
    let mut file = file.clone();
    plain.for_each(|nearly| nearly.put(&mut file.robot.link));
    file.robot().parameters().len()
}

/// What of the geometry makes a parameter that the rows do not show, where the condition number is that of such a one.
pub(crate) fn geometry(
    setup: &RobotSetup,
    condition: Option<f64>,
    unknowns: &[FittedUnknown],
) -> Vec<Finding> {
    let file = &setup.file;
    let open = |u: &&FittedUnknown| u.joint.is_none() && u.verdict == Verdict::NotIdentifiable;
    let poor = condition.is_none_or(|condition| condition > MAX_CONDITION);
    if file.robot.model != ModelKind::Serial || !poor || !unknowns.iter().any(|u| open(&u)) {
        return Vec::new();
    }
    let nearly = all_nearly(&file.robot.link);
    let declared = setup.robot.parameters().len();
    let plain = parameters(file, nearly.iter());
    if nearly.is_empty() || plain >= declared {
        return Vec::new();
    }
    // one that alone keeps a parameter; together they may, where none does alone
    let keeps = |k: &usize| {
        let others = nearly.iter().enumerate().filter(|(other, _)| other != k);
        parameters(file, others.map(|(_, nearly)| nearly)) > plain
    };
    let alone: Vec<usize> = (0..nearly.len()).filter(keeps).collect();
    let named = match alone.is_empty() {
        true => (0..nearly.len()).collect(),
        false => alone,
    };
    let largest = unknowns
        .iter()
        .filter(open)
        .max_by(|a, b| a.fitted_std.total_cmp(&b.fitted_std));
    let largest = largest.map_or_else(String::new, |u| {
        format!(
            " ({} = {:.3e} +- {:.1e} {})",
            u.key, u.fitted, u.fitted_std, u.unit
        )
    });
    let finding = |k: usize| nearly[k].finding(file, declared - plain, &largest);
    named.into_iter().map(finding).collect()
}
