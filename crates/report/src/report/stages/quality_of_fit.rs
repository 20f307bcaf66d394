//! How good a fit is: its condition, what it left open, how its estimator went, and links that can exist.

use crate::report::Writer;
use crate::report::table::{Align, Table, unbroken};
use cft_ident_core::math::descent::Ending;
use cft_ident_core::number;
use cft_ident_core::verdict::{Verdict, WEAK};
use cft_ident_stages::identify::{Account, ConsistentLinks, IdentifiedDynamics, JointAccount};

/// Condition, rank and effective sample size of the fit.
pub(super) fn condition(terminal: &mut Writer, found: &IdentifiedDynamics) {
    let fit = &found.fit;
    let condition = |c: Option<f64>| c.map_or("infinite".to_owned(), |c| number::significant(c, 4));
    terminal.paragraph(&format!(
        "condition {} raw, {} normalised; rank {} of {}; {} rows a joint, effective sample size {:.0}",
        condition(fit.condition.raw),
        condition(fit.condition.normalised),
        fit.rank,
        found.unknowns.len(),
        fit.rows,
        fit.effective_rows,
    ));
    open_directions(terminal, found);
}

/// How the fit came about, and which parameters are significant.
pub(super) fn fit_quality(terminal: &mut Writer, found: &IdentifiedDynamics) {
    cutoffs(terminal, found);
    account(terminal, &found.account);
    let alone = found.essential.joints.iter();
    let alone = alone.map(|e| {
        unbroken(&format!(
            "{} {}",
            e.joint,
            number::percent(e.relative_error)
        ))
    });
    terminal.paragraph(&format!(
        "{} of {} parameters are significant (F test, 1 %); residual with them alone: {}",
        found.essential.count,
        found.unknowns.len(),
        alone.collect::<Vec<_>>().join(", ")
    ));
}

/// The position cut-offs that were found, and what they leave of friction's errors at reversals.
fn cutoffs(terminal: &mut Writer, found: &IdentifiedDynamics) {
    let found = found.position_cutoffs.iter().filter(|c| !c.declared);
    let found: Vec<String> = found
        .map(|c| {
            let (hz, off) = (c.cutoff_hz, c.smear.hypot(c.noise));
            unbroken(&format!(
                "{} {} Hz ({} {})",
                c.joint,
                number::significant(hz, 3),
                number::significant(off, 2),
                c.unit
            ))
        })
        .collect();
    if !found.is_empty() {
        terminal.paragraph(&format!(
            "position cut-offs found from the logs, and the error of friction that is left at reversals: {}",
            found.join(", ")
        ));
    }
}

/// What rank and verdicts say together, where a parameter is called not identifiable: that the
/// motion does not excite it, or that the noise is larger than its torque.
fn open_directions(terminal: &mut Writer, found: &IdentifiedDynamics) {
    let unknowns = found.unknowns.iter();
    let open = unknowns.filter(|u| u.verdict == Verdict::NotIdentifiable);
    let all = open.count();
    if all == 0 {
        return;
    }
    let missing = found.unknowns.len().saturating_sub(found.fit.rank);
    let noise = format!("a standard deviation above {:.0} %", 100.0 * WEAK);
    terminal.paragraph(&match missing {
        0 => format!(
            "all {} base parameters are excited; {all} have {noise}",
            found.unknowns.len()
        ),
        _ => format!(
            "{missing} combinations of parameters are not excited; the {all} not-identifiable are in these, or \
             have {noise}"
        ),
    });
}

/// How the estimator went; nothing for least squares.
fn account(terminal: &mut Writer, account: &Account) {
    let ended = match account.status {
        Ending::Converged => "converged",
        Ending::IterationLimit => "stopped at the limit of iterations",
        Ending::Diverged => "diverged",
    };
    if account.iterations > 1 {
        terminal.line(&format!(
            "{}: {ended} after {} passes over the logs",
            account.estimator.name(),
            account.iterations
        ));
    }
    let each = |shown: &dyn Fn(&JointAccount) -> Option<String>| {
        let joints = account.joints.iter();
        let words = joints.filter_map(|of| Some(format!("{} {}", of.joint, shown(of)?)));
        Some(words.collect::<Vec<_>>().join(", ")).filter(|words| !words.is_empty())
    };
    if let Some(shares) = each(&|of| of.down_weighted.map(number::percent)) {
        terminal.line(&format!("rows of less than half weight: {shares}"));
    }
    if let Some(simulated) = &account.simulated {
        let gains = each(&|of| {
            let [k, d] = [of.proportional?, of.derivative?].map(|x| number::significant(x, 3));
            Some(format!("{k} and {d}"))
        });
        terminal.line(&format!(
            "simulated in closed loop at {} rad/s, gains on position and velocity: {}",
            number::significant(simulated.loop_frequency, 3),
            gains.unwrap_or_default()
        ));
    }
    if let Some(errors) = each(&|of| of.relative_error_before.map(number::percent)) {
        terminal.line(&format!("residual before the refinement: {errors}"));
    }
}

/// Links that can exist.
pub(super) fn bodies(found: &ConsistentLinks) -> Table {
    let numbers = ["mass", "x", "y", "z", "Ixx", "Iyy", "Izz"].map(|name| (name, Align::Decimal));
    let mut columns = vec![("link", Align::Left)];
    columns.extend(numbers);
    let mut table = Table::new(&columns)
        .caption("links that can exist: kg, centre of gravity in m, moments about it in kg m^2");
    for link in &found.links {
        let [xx, _, _, yy, _, zz] = link.inertia;
        let mut row = vec![link.name.clone(), number::significant(link.mass, 4)];
        row.extend(link.centre.map(|x| number::significant(x, 3)));
        row.extend([xx, yy, zz].map(|x| number::significant(x, 3)));
        table.row(row);
    }
    table
}

/// Drives that can exist, and by how much the fit suffers from links that can.
pub(super) fn consistent(terminal: &mut Writer, found: &ConsistentLinks) {
    let drives = found.drives.iter();
    let drives: Vec<String> = drives
        .map(|drive| format!("{} {}", drive.joint, number::significant(drive.inertia, 3)))
        .collect();
    if !drives.is_empty() {
        terminal.line(&format!("drive inertias: {}", drives.join(", ")));
    }
    let both = found.relative_error_before.iter();
    let both = both.zip(&found.relative_error_after);
    let change = both.map(|(before, after)| {
        let [from, to] = [before, after].map(|e| number::percent(e.relative_error));
        unbroken(&format!("{} {from} to {to}", before.joint))
    });
    let change: Vec<String> = change.collect();
    terminal.paragraph(&format!(
        "what consistency costs the fit: {}",
        change.join(", ")
    ));
}
