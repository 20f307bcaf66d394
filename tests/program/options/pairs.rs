//! Every pair of options of a fit on a measured drive and an own plant: no pair errs more than its parts, and what is written
//! predicts the torque that was printed.

use std::path::Path;

use cft_ident::cli::CommandLine;
use clap::{ArgAction, CommandFactory};

use super::{done, faults, options_of, run};
use crate::hostile_bench::Bench;
use crate::measured_support::shared;

/// Most by which two options together may err more than the worse of them alone.
const MOST: f64 = 1.2;

/// What a fit is asked for by options that are a flag or have a list of values, those that contradict one of `given` left
/// out; each with the option that it is of.
fn choices(command: &str, given: &[&str]) -> Vec<(String, String)> {
    let all = CommandLine::command();
    let found = all.find_subcommand(command).unwrap();
    let mut out = Vec::new();
    for arg in options_of(command) {
        let name = arg.get_long().unwrap().to_owned();
        let others = found.get_arg_conflicts_with(&arg);
        let contradicts = |given: &&str| others.iter().any(|a| a.get_long() == Some(given));
        if given
            .iter()
            .any(|given| contradicts(given) || *given == name)
        {
            continue;
        }
        let values = arg.get_possible_values();
        match arg.get_action() {
            ArgAction::SetTrue => out.push((name.clone(), format!("--{name}"))),
            _ => out.extend(
                values
                    .iter()
                    .map(|v| (name.clone(), format!("--{name} {}", v.get_name()))),
            ),
        }
    }
    out
}

/// The error of a fit by its options and the file that it writes, none where it is refused; or what is wrong with it.
type ErrorOf<'a> = dyn Fn(&str, &str) -> Result<Option<f64>, String> + Sync + 'a;

/// Runs a fit alone with each choice and with each pair of two options. `line` makes the command that writes a file;
/// `error` its error, or what is wrong with it.
fn check(choices: &[(String, String)], error: &ErrorOf) {
    let single: Vec<(usize, &str)> = (choices.iter().enumerate())
        .map(|(i, (_, words))| (i, words.as_str()))
        .collect();
    let single_errors = std::sync::Mutex::new(vec![None; choices.len()]);
    let mut found = faults(&single, |(i, words)| {
        match error(words, &format!("a{i}.toml")) {
            Ok(error) => {
                single_errors.lock().unwrap()[*i] = error;
                None
            }
            Err(fault) => Some(fault),
        }
    });
    let alone = single_errors.into_inner().unwrap();
    let mut pairs = Vec::new();
    for (j, (of_second, _)) in choices.iter().enumerate() {
        let before = choices[..j].iter().enumerate();
        let others = before.filter(|(_, (of_first, _))| of_first != of_second);
        pairs.extend(others.map(|(i, _)| (i, j)));
    }
    assert!(pairs.len() > 3, "{choices:?}");
    found.extend(faults(&pairs, |(i, j)| {
        let words = format!("{} {}", choices[*i].1, choices[*j].1);
        let both = match error(&words, &format!("p{i}-{j}.toml")) {
            Ok(Some(both)) => both,
            Ok(None) => return None,
            Err(fault) => return Some(fault),
        };
        // an option may make a fit worse by itself, as its help says: held friction, rows without weights
        let alone = [*i, *j].into_iter().filter_map(|k| alone[k]);
        let greater = alone.fold(0.0, f64::max);
        let wrong = both > MOST * greater;
        wrong.then(|| format!("{words}: error {both}, of each alone at most {greater}"))
    }));
    assert!(found.is_empty(), "{found:#?}");
}

/// The error that `lsq` prints, which is that of the file by `validate`; none where the two options are refused together.
fn fitted(
    folder: &Path,
    (log, given): (&str, &str),
    words: &str,
    to: &str,
) -> Result<Option<f64>, String> {
    let ended = run(folder, &format!("lsq {log} {given} -o {to} {words}"));
    match ended.status {
        Some(0) => {}
        Some(2) => return Ok(None),
        _ => return Err(format!("{}: {}", ended.line, ended.stderr)),
    }
    let validated = run(folder, &format!("validate {log} -m {to}"));
    if validated.status != Some(0) {
        return Err(format!("{}: {}", ended.line, validated.stderr));
    }
    let (printed, written) = (ended.error(), validated.error());
    match (printed - written).abs() <= 1e-6 * printed {
        true => Ok(Some(printed)),
        false => Err(format!(
            "{}: printed {printed}, written {written}",
            ended.line
        )),
    }
}

/// The error that a refined model leaves of the rows that it was refined on, at most that of the model given.
fn refined(
    folder: &Path,
    (log, model): (&str, &str),
    words: &str,
    to: &str,
) -> Result<Option<f64>, String> {
    let ended = run(
        folder,
        &format!("diagnose {log} -m {model} -o {to} {words}"),
    );
    match ended.status {
        Some(0) => {}
        Some(2 | 4) => return Ok(None),
        _ => return Err(format!("{}: {}", ended.line, ended.stderr)),
    }
    let error = |model: &str| done(folder, &format!("validate {log} -m {model}")).error();
    let [before, after] = [model, to].map(error);
    match after <= MOST * before {
        true => Ok(Some(after)),
        false => Err(format!(
            "{}: error {before} before, {after} after",
            ended.line
        )),
    }
}

#[test]
fn no_pair_of_options_of_a_fit_errs_more_than_both_of_them_alone() {
    let choices = choices("lsq", &["model", "output", "robot"]);
    for needed in ["--hold-friction", "--unconstrained", "--estimator oe"] {
        assert!(
            choices.iter().any(|(_, words)| words == needed),
            "{choices:?}"
        );
    }
    let bench = Bench::new();
    let folder = bench.folder();
    done(folder, "friction other.csv -r slide.toml -o friction.toml");
    check(&choices, &|words, to| {
        let given = "-r slide.toml -m friction.toml";
        fitted(folder, ("good.csv", given), words, to)
    });
    if let Some(log) = shared("emps/emps_id.csv") {
        let log = log.to_str().unwrap();
        done(
            folder,
            &format!("friction {log} -r configs/emps.toml -o fe.toml"),
        );
        check(&choices, &|words, to| {
            let given = "-r configs/emps.toml -m fe.toml";
            fitted(folder, (log, given), words, to)
        });
    }
}

#[test]
fn no_pair_of_options_of_a_diagnosis_spoils_the_model_that_it_is_given_on_its_own_rows_and_on_others()
 {
    let folder = tempfile::tempdir().unwrap();
    let mut choices = choices("diagnose", &["model", "output"]);
    let accepted = ["delay", "rotor-inertia", "asymmetric-friction"];
    let Some(log) = shared("emps/emps_id.csv") else {
        return;
    };
    let log = log.to_str().unwrap();
    done(
        folder.path(),
        &format!("lsq {log} -r configs/emps.toml -o m.toml"),
    );
    choices.retain(|(name, _)| name != "search");
    choices.extend(accepted.map(|effect| ("accept".to_owned(), format!("--accept {effect}:q1"))));
    for rows in ["", "@0..60%"] {
        let log = format!("{log}{rows}");
        check(&choices, &|words, to| {
            let to = format!("{}{to}", rows.len());
            refined(folder.path(), (&log, "m.toml"), words, &to)
        });
    }
}
