//! How good a fit is: its condition, open directions, how its estimator went, and links that can exist.

use crate::report::table::{Columns, Table, unbroken};
use crate::report::words::listed;
use crate::report::{Writer, words};
use cft_ident_core::math::descent::IterationEnding;
use cft_ident_core::number;
use cft_ident_core::verdict::{Verdict, WEAK};
use cft_ident_stages::identify::{
    ConsistentLinks, EstimatorAccount, IdentifiedDynamics, JointAccount,
};

/// Condition, rank and effective sample size of the fit.
pub(super) fn condition(terminal: &mut Writer, found: &IdentifiedDynamics) {
    let fit = &found.fit;
    terminal.paragraph(&format!(
        "condition {} raw, {} normalised; rank {} of {}; {} rows a joint, effective sample size {:.0}",
        words::condition(fit.condition.raw),
        words::condition(fit.condition.normalised),
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
        let error = number::percent(e.relative_error);
        unbroken(&format!("{} {error}", e.joint))
    });
    terminal.paragraph(&format!(
        "{} of {} parameters are significant (F test, 1 %); residual with them alone: {}",
        found.essential.count,
        found.unknowns.len(),
        listed(alone)
    ));
}

/// The position cut-offs that were found, and the error of friction that they leave at reversals.
fn cutoffs(terminal: &mut Writer, found: &IdentifiedDynamics) {
    let found = found.position_cutoffs.iter().filter(|c| !c.declared);
    let found = listed(found.map(|c| {
        let hz = number::significant(c.cutoff_hz, 3);
        let off = number::significant(c.smear.hypot(c.noise), 2);
        unbroken(&format!("{} {hz} Hz ({off} {})", c.joint, c.unit))
    }));
    if !found.is_empty() {
        terminal.paragraph(&format!(
            "position cut-offs found from the logs, and the error of friction that is left at reversals: {found}"
        ));
    }
}

/// Why parameters are called not identifiable: the motion does not excite them, or the noise is larger than their torque.
fn open_directions(terminal: &mut Writer, found: &IdentifiedDynamics) {
    let unknowns = found.unknowns.iter();
    let open = unknowns
        .filter(|u| u.verdict == Verdict::NotIdentifiable)
        .count();
    if open == 0 {
        return;
    }
    let all = found.unknowns.len();
    let noise = format!(
        "a standard deviation above {:.0} % of their value",
        100.0 * WEAK
    );
    terminal.paragraph(&match all.saturating_sub(found.fit.rank) {
        0 => format!("all {all} base parameters are excited; {open} have {noise}"),
        missing => format!(
            "{missing} combinations of parameters are not excited; the {open} not-identifiable are in these, or \
             have {noise}"
        ),
    });
}

/// How the estimator went; nothing for least squares.
fn account(terminal: &mut Writer, account: &EstimatorAccount) {
    let ended = match account.status {
        IterationEnding::Converged => "converged",
        IterationEnding::IterationLimit => "stopped at the limit of iterations",
        IterationEnding::Diverged => "diverged",
    };
    let passes = account.iterations;
    if passes > 1 {
        let estimator = account.estimator.name();
        terminal.line(&format!(
            "{estimator}: {ended} after {passes} passes over the logs"
        ));
    }
    let each = |shown: &dyn Fn(&JointAccount) -> Option<String>| {
        let joints = account.joints.iter();
        listed(joints.filter_map(|of| Some(format!("{} {}", of.joint, shown(of)?))))
    };
    let shares = each(&|of| of.down_weighted.map(number::percent));
    if !shares.is_empty() {
        terminal.line(&format!("samples of less than half weight: {shares}"));
    }
    if let Some(simulated) = &account.simulated {
        let gains = each(&|of| {
            let [k, d] = [of.proportional?, of.derivative?].map(|x| number::significant(x, 3));
            Some(format!("{k} and {d}"))
        });
        terminal.line(&format!(
            "simulated in closed loop at {} rad/s, gains on position and velocity: {gains}",
            number::significant(simulated.loop_frequency, 3),
        ));
    }
    let errors = each(&|of| of.relative_error_before.map(number::percent));
    if !errors.is_empty() {
        terminal.line(&format!("residual before the refinement: {errors}"));
    }
}

/// Links that can exist.
pub(super) fn bodies(found: &ConsistentLinks) -> Table {
    let caption =
        "physically consistent links: kg, centre of gravity in m, moments about it in kg m^2";
    let mut columns = Columns::new(caption, &found.links)
        .words("link", |link| &link.name)
        .digits("mass", 4, |link| link.mass);
    for (k, name) in ["x", "y", "z"].into_iter().enumerate() {
        columns = columns.digits(name, 3, |link| link.centre[k]);
    }
    for (k, name) in [(0, "Ixx"), (3, "Iyy"), (5, "Izz")] {
        columns = columns.digits(name, 3, |link| link.inertia[k]);
    }
    columns.into()
}

/// Drives that can exist, and how near the search came to its optimum.
pub(super) fn consistent(terminal: &mut Writer, found: &ConsistentLinks) {
    let drives = found.drives.iter();
    let drives =
        drives.map(|drive| format!("{} {}", drive.joint, number::significant(drive.inertia, 3)));
    let drives = listed(drives);
    if !drives.is_empty() {
        terminal.line(&format!("drive inertias: {drives}"));
    }
    terminal.line(&format!(
        "physically consistent fit: duality gap {} of the squares, {} steps",
        number::percent(found.duality_gap),
        found.iterations
    ));
}
