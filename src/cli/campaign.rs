//! The built-in campaign of `identify`: the simulated CFT robot, its logs by role, and the files
//! that describe them, written so that the same run can be repeated from the folder alone.

use std::path::Path;

use rayon::prelude::*;

use super::simulate::{simulate_to, truth_beside, warnings};
use super::{CliError, Context};
use cft_ident_files::config::campaign::{CampaignLogs, CampaignSettings};
use cft_ident_files::config::{self, CampaignFile, RobotFile, Trajectory, WantedFile};
use cft_ident_plant::simulate::{EffectSpec, Experiment, Order};

/// Robot file and motions of the campaign, as they come with the tool.
pub(super) const ROBOT: &str = "configs/cft.toml";
/// Designed by `excite` for all parameters; it ends by itself, after about 40 s.
const EXCITATION: &str = "configs/cft-excitation.toml";
const UNSEEN: &str = "configs/cft-validation.toml";
/// The plant has it and the declared model lacks it: the ripple of a screw, some times as strong as the noise.
const EFFECT: &str = "ripple:q1:order=14,sin=1.2,cos=0.6";
/// Length of a one-joint experiment and of the unseen motion [s].
const ONE_JOINT_S: f64 = 20.0;
const UNSEEN_S: f64 = 20.0;

/// Simulates the campaign into `folder` and writes its campaign file; names of the files, and warnings.
pub(super) fn simulate(
    folder: &Path,
    seed: u64,
    context: &Context,
) -> Result<(Vec<String>, Vec<String>), CliError> {
    let robot = RobotFile::load(Path::new(ROBOT))?;
    let excitation = Trajectory::load(Path::new(EXCITATION))?;
    let unseen = Trajectory::load(Path::new(UNSEEN))?;
    let joints = robot.joint_names();
    let moves: Vec<String> = joints.iter().map(|j| format!("{j}.csv")).collect();
    let each = joints.iter().zip(&moves);
    let each = each.map(|(joint, log)| (&**log, Experiment::of_joint(joint), Some(ONE_JOINT_S)));
    let excitation = Experiment::Trajectory(&excitation);
    let unseen = Experiment::Trajectory(&unseen);
    let whole = [
        ("identification.csv", excitation, None),
        ("unseen.csv", unseen, Some(UNSEEN_S)),
    ];
    let orders: Vec<(&str, Experiment, Option<f64>)> = each.chain(whole).collect();
    let effects = vec![EFFECT.parse::<EffectSpec>().map_err(CliError::input)?];
    let bar = context.progress("simulating the campaign", Some(orders.len() as u64));
    let simulated = |(i, (log, experiment, seconds)): (usize, &(&str, Experiment, Option<f64>))| {
        let order = Order {
            robot: &robot,
            model: None,
            experiment: *experiment,
            seconds: *seconds,
            effects: effects.clone(),
            // every experiment has noise of its own
            seed: seed.wrapping_mul(1000).wrapping_add(i as u64),
        };
        let (simulated, _) = simulate_to(&order, None, &folder.join(log), context)?;
        bar.advance(1);
        let named = warnings(&simulated);
        Ok(named.into_iter().map(|w| format!("{log}: {w}")).collect())
    };
    let each = orders.par_iter().enumerate();
    let said: Vec<Result<Vec<String>, CliError>> = each.map(simulated).collect();
    let mut files = vec!["campaign.toml".to_owned(), "robot.toml".to_owned()];
    for (log, ..) in &orders {
        let truth = truth_beside(Path::new(log));
        files.extend([(*log).to_owned(), truth.display().to_string()]);
    }
    let said = said.into_iter().collect::<Result<Vec<_>, _>>()?.concat();
    let campaign = CampaignFile {
        robot: "robot.toml".into(),
        truth: Some("identification.truth.toml".into()),
        logs: CampaignLogs {
            friction: moves,
            identification: vec!["identification.csv".into()],
            validation: vec!["unseen.csv".into()],
            ..CampaignLogs::default()
        },
        settings: CampaignSettings {
            seed: Some(seed),
            ..CampaignSettings::default()
        },
    };
    let text = toml::to_string(&campaign)
        .map_err(|e| CliError::output(format!("the campaign cannot be expressed in TOML: {e}")))?;
    let robot_text = config::text_of_kind(Path::new(ROBOT), WantedFile::Robot)?;
    let head = "# The built-in campaign: repeat it with `cft-ident identify campaign.toml`.\n\n";
    context.write_text(&folder.join("robot.toml"), &robot_text)?;
    context.write_text(&folder.join("campaign.toml"), &format!("{head}{text}"))?;
    // what is identified next reads them
    context.files.commit()?;
    Ok((files, said))
}
