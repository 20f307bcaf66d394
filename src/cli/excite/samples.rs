//! A motion sample by sample, ready for a controller.

use std::path::Path;

use super::ExciteRun;
use crate::cli::{CliError, columns_of};
use cft_ident_core::number;
use cft_ident_files::config::trajectory::TrajectoryCoordinates;
use cft_ident_logs::output::LogWriter;
use cft_ident_plant::excite::{ExciteError, Motion};

/// Most samples that a file may have.
const MOST_ROWS: f64 = 1e8;
/// Rows between two looks at Ctrl-C.
const BLOCK: usize = 4096;

/// Writes t, and positions, speeds and accelerations of the joints and of actuators that differ.
pub(super) fn write(bench: &ExciteRun, motion: &Motion, path: &Path) -> Result<(), CliError> {
    let machine = &bench.machine;
    let n = machine.coordinates();
    let actuators = machine.designed() == TrajectoryCoordinates::Cartesian;
    let mut header = columns_of(&["q", "dq", "ddq"], machine.model.robot.joint_names());
    if actuators {
        for prefix in ["", "d", "dd"] {
            let names = machine.coordinate_names().into_iter();
            header.extend(names.map(|name| format!("{prefix}{name}")));
        }
    }
    let rows = rows(bench, motion, MOST_ROWS)?;
    let notes: Vec<String> = machine.source.caution().into_iter().collect();
    let mut writer = LogWriter::with_notes(path, &header, &notes)?;
    for k in 0..rows {
        if k % BLOCK == 0 {
            bench.context.check()?;
        }
        let t = k as f64 / bench.rate_hz;
        let state = machine.joints(&motion.at(t)).map_err(ExciteError::Robot)?;
        let joints = [state.q, state.v, state.a];
        let coordinates = [state.k.x, state.k.xd, state.k.xdd];
        let shown = if actuators { &coordinates[..] } else { &[] };
        let values = joints.iter().chain(shown);
        let values = values.flat_map(|values| values[..n].iter().copied());
        writer.row(std::iter::once(t).chain(values))?;
    }
    Ok(bench.context.files.add_log(writer)?)
}

/// Number of samples of a motion, of which a file may have `most`.
pub(super) fn rows(bench: &ExciteRun, motion: &Motion, most: f64) -> Result<usize, CliError> {
    if motion.seconds() * bench.rate_hz > most {
        let [s, hz] = [motion.seconds(), bench.rate_hz].map(|x| number::significant(x, 4));
        let text = format!("{s} s at {hz} Hz are more than {most:e} samples");
        return Err(CliError::input(text).hint("give a lower --rate, or a shorter motion"));
    }
    Ok((motion.seconds() * bench.rate_hz + 1e-6).floor() as usize + 1)
}
