//! The whole way from a simulated log to a validated model, at the rooms' borders and through the
//! command line.

use std::convert::Infallible;
use std::path::Path;
use std::process::Command;

use cft_ident::inertia::accumulate;
use cft_ident::inertia::columns::{KnownFriction, RegressorColumns};
use cft_ident::inertia::solve::{Fit, RowWeighting, fit};
use cft_ident::log::Block;
use cft_ident::motion::{FilterSettings as Processing, ZeroOrderHold};
use cft_ident::robot::Robot;
use cft_ident::robot::cft::{LaboratorySetup, ParameterStructure};
use cft_ident::simulate::cft::{excitation, follow};
use cft_ident::simulate::{CftTruth, PlantSensors, Settings, SimulatedRun};

fn source(block: &Block) -> impl FnMut(&mut Block) -> Result<bool, Infallible> + '_ {
    move |out| {
        out.t.extend_from_slice(&block.t);
        out.q.extend_from_slice(&block.q);
        out.tau.extend_from_slice(&block.tau);
        Ok(false)
    }
}

fn fitted(robot: &Robot, truth: &CftTruth, recording: &SimulatedRun<4>) -> Fit {
    let mut log = Block {
        t: recording.t.clone(),
        q: recording.q.concat(),
        tau: recording.torque.concat(),
        ..Block::default()
    };
    ZeroOrderHold::new(4).centre(robot, &mut log);
    let known = truth.friction.map(|law| {
        Some(KnownFriction {
            law,
            covariance: [[0.0; 5]; 5],
            held: [true; 5],
        })
    });
    let columns = RegressorColumns {
        joints: 4,
        shared: 12,
        own: vec![Vec::new(); 4],
        known: known.to_vec(),
        rest_speed: Vec::new(),
    };
    let processing = Processing {
        q_cutoff_hz: Some(100.0),
        ..Processing::default()
    };
    let (sums, _) = accumulate(robot, &columns, &processing, &mut source(&log)).unwrap();
    fit(&sums, RowWeighting::Wls).unwrap()
}

#[test]
fn noise_free_data_give_theta_within_a_thousandth() {
    let robot = Robot::cft(LaboratorySetup::Tuedacs, ParameterStructure::Printed12);
    let truth = CftTruth::synthetic(LaboratorySetup::Tuedacs);
    let mut settings = Settings::new(30.0);
    settings.sensors = PlantSensors::perfect();
    let recording = follow(&truth, &[], excitation(LaboratorySetup::Tuedacs), &settings).unwrap();
    let fit = fitted(&robot, &truth, &recording);
    assert_eq!(fit.rank, 12);
    for i in 0..12 {
        // a weak direction is one in which a thousandth of the torque is more than a thousandth of
        // the parameter
        let reach: f64 = (0..4)
            .map(|j| (fit.theta[i] * fit.column_rms[(j, i)] / fit.torque_rms[j]).abs())
            .fold(0.0, f64::max);
        let off = (fit.theta[i] / truth.theta[i] - 1.0).abs();
        println!("theta_{}: off {off:.2e}, {reach:.4} of the torque", i + 1);
        if reach > 0.02 {
            assert!(off < 1e-3, "theta_{}: {off}", i + 1);
        }
    }
    assert!(
        fit.relative_error.iter().all(|e| e.all < 3e-4),
        "{:?}",
        fit.relative_error
    );
}

#[test]
fn without_acceleration_of_q1_theta_1_is_lost_and_named() {
    let robot = Robot::cft(LaboratorySetup::Tuedacs, ParameterStructure::Printed12);
    let mut chance = 7u64;
    let mut uniform = move || {
        chance ^= chance << 13;
        chance ^= chance >> 7;
        chance ^= chance << 17;
        (chance >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    };
    let columns = RegressorColumns {
        joints: 4,
        shared: 12,
        own: vec![Vec::new(); 4],
        known: vec![None; 4],
        rest_speed: Vec::new(),
    };
    let mut sums = cft_ident::inertia::accumulate::RowAccumulator::new(columns.clone(), 0.25);
    let mut channels = vec![0.0; columns.channels()];
    for k in 0..400 {
        let q = [0.3, uniform(), 0.3 + 0.5 * uniform(), 1.5 + 0.5 * uniform()];
        let v = [0.0, uniform(), uniform(), uniform()];
        let a = [0.0, uniform(), uniform(), uniform()];
        let theta = CftTruth::synthetic(LaboratorySetup::Tuedacs).printed();
        let mut y = [0.0; 48];
        robot.regressor(&q, &v, &a, &mut y);
        let tau: Vec<f64> = (0..4)
            .map(|j| (0..12).map(|i| y[j * 12 + i] * theta[i]).sum())
            .collect();
        columns.fill(&robot, &q, &v, &a, &tau, &mut channels);
        sums.add(0, f64::from(k) * 0.01, &channels);
    }
    let fit = fit(&sums.finish(), RowWeighting::Wls).unwrap();
    assert_eq!(fit.rank, 11);
    assert!(!fit.determined[0]);
    assert_eq!(fit.confounded.len(), 1);
    assert_eq!(fit.confounded[0].terms[0].0, 0);
    let truth = CftTruth::synthetic(LaboratorySetup::Tuedacs).printed();
    for (found, truth) in fit.theta.iter().zip(&truth).skip(1) {
        assert!((found - truth).abs() < 1e-9 * truth.abs().max(1.0));
    }
}

fn identify(folder: &Path, threads: &str) {
    let status = Command::new(env!("CARGO_BIN_EXE_cft-ident"))
        .args(["identify", "-q", "--threads", threads, "--seed", "5", "-o"])
        .arg(folder)
        .output()
        .unwrap();
    let said = String::from_utf8_lossy(&status.stderr);
    assert!(status.status.success(), "{said}");
}

#[test]
fn the_built_in_campaign_meets_its_limits_and_no_thread_count_changes_a_byte() {
    let folder = tempfile::tempdir().unwrap();
    let (one, two) = (folder.path().join("one"), folder.path().join("two"));
    identify(&one, "1");
    identify(&two, "2");
    let mut names: Vec<_> = std::fs::read_dir(&one)
        .unwrap()
        .map(|entry| entry.unwrap().file_name())
        .collect();
    names.sort();
    assert!(names.len() >= 15, "{names:?}");
    for name in &names {
        let (a, b) = (std::fs::read(one.join(name)), std::fs::read(two.join(name)));
        assert!(a.unwrap() == b.unwrap(), "{} differs", name.display());
    }
    let text = std::fs::read_to_string(one.join("result.json")).unwrap();
    let result: serde_json::Value = serde_json::from_str(&text).unwrap();
    let page = std::fs::read_to_string(one.join("report.html")).unwrap();
    assert!(page.len() < 5_000_000 && page.ends_with("</html>\n"));
    assert!(page.contains("confirmed</b> ripple of q1, "));
    let files = result["files"].as_array().unwrap();
    assert!(files.contains(&"report.html".into()), "{files:?}");
    // the declared model lacks an effect of q1; the refined one lacks nothing
    let declared = result["validate"]["joints"].as_array().unwrap();
    let refined = result["diagnose"]["after"]["holdout"]["joints"]
        .as_array()
        .unwrap();
    assert_eq!((declared.len(), refined.len()), (4, 4));
    for joint in declared[1..].iter().chain(refined) {
        let error = joint["relative_error"].as_f64().unwrap();
        assert!(error < 0.008, "{joint}");
    }
    let parameters = result["lsq"]["parameters"].as_array().unwrap();
    let identified = parameters
        .iter()
        .filter(|p| p["verdict"] == "identified")
        .count();
    assert!(identified >= 10, "{identified} of 12");
    let compared = result["truth"]["parameters"].as_array().unwrap();
    assert_eq!(compared.len(), 32);
    for p in compared {
        // 32 draws: beyond 4.5 standard deviations is no chance
        let off = p["standard_deviations_off"].as_f64().unwrap();
        assert!(off.abs() < 4.5, "{p}");
    }
    // the campaign carries a ripple that its declared model lacks: that, and nothing else, is found
    let diagnosis = &result["diagnose"];
    assert_eq!(diagnosis["verdict"], "effects-found");
    let steps = diagnosis["steps"].as_array().unwrap().iter();
    let written: Vec<&serde_json::Value> = steps.filter(|step| step["written"] == true).collect();
    assert_eq!(written.len(), 1);
    let step = written[0];
    assert_eq!(
        (&step["effect"], &step["joint"]),
        (&"ripple".into(), &"q1".into())
    );
    // an order is as sharp as the travel lets it be, and the phase goes with it
    let number = |key: &str, of: &str| step["parameters"][key][of].as_f64().unwrap();
    assert!((number("order", "value") - 14.0).abs() < 0.1);
    let size = number("sin", "value").hypot(number("cos", "value"));
    let std = number("sin", "std").hypot(number("cos", "std"));
    let off = (size - 1.2_f64.hypot(0.6)) / std;
    assert!(off.abs() < 3.0, "{size}: {off} standard deviations");
    let unseen = |when: &str| diagnosis[when]["holdout"]["joints"][0]["relative_error"].as_f64();
    assert!(unseen("after").unwrap() < 0.5 * unseen("before").unwrap());
    for joint in result["friction"]["joints"].as_array().unwrap() {
        assert_eq!(joint["converged"], true);
        assert_eq!(joint["curve"].as_array().unwrap().len(), 100);
        for key in ["viscous", "coulomb_1", "coulomb_2", "slope_1", "slope_2"] {
            assert_eq!(joint["parameters"][key]["verdict"], "identified", "{key}");
        }
    }
}
