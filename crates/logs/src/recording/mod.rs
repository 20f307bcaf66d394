//! A log that was read.

mod torque_course;

use std::cell::RefCell;
use std::sync::Arc;

pub use self::torque_course::TorqueCourse;
use crate::inspect::speeds::SpeedMeter;
use crate::inspect::{InspectionGate, RowCutter};
use crate::log::{
    Block, Instant, JointTemperatures, Layout, LogArrays, LogError, LogSpec, Provenance, RawBlock,
    RawReader, Reader, RowFault, RowStore,
};
use cft_ident_core::motion::ZeroOrderHold;
use cft_ident_core::robot::Robot;

/// What is read of a log.
pub struct RecordingRequest<'a> {
    /// Channels of the joints, conversions among it.
    pub layout: Layout,
    /// Channels of the positions that the controller was asked for, where they are known.
    pub references: Option<Layout>,
    /// Joints whose temperatures are logged, and their channels.
    pub temperatures: Option<(Vec<usize>, Layout)>,
    /// Faults that are left in it.
    pub keep: &'a [RowFault],
    /// Whether reading is to end.
    pub stop: &'a dyn Fn() -> bool,
    /// Recordings of which some may have its rows already.
    pub beside: &'a [&'a Recording],
}

/// The rows of a log by one layout.
#[derive(Debug, Clone)]
enum RecordedRows {
    Parsed(LogSpec, Arc<RowStore>, Layout),
    Arrays(Arc<LogArrays>, Layout),
}

impl RecordedRows {
    fn reader(&self) -> Result<Reader, LogError> {
        match self {
            Self::Parsed(spec, store, layout) => Reader::along(spec, store, layout),
            Self::Arrays(arrays, layout) => Reader::of_arrays(arrays, layout.clone()),
        }
    }

    fn layout(&self) -> &Layout {
        match self {
            Self::Parsed(_, _, layout) | Self::Arrays(_, layout) => layout,
        }
    }

    fn as_logged(&self) -> Self {
        let mut rows = self.clone();
        match &mut rows {
            Self::Parsed(_, _, layout) | Self::Arrays(_, layout) => {
                *layout = layout.clone().as_logged();
            }
        }
        rows
    }
}

/// A log that was read: its rows in order of time, and what was found wrong with them.
#[derive(Debug, Clone)]
pub struct Recording {
    rows: RecordedRows,
    references: Option<Result<RecordedRows, LogError>>,
    temperatures: Result<JointTemperatures, LogError>,
    /// Faults, rows that are left out, and what is mended.
    pub inspection: InspectionGate,
    /// Speed up to which each joint rests [m/s or rad/s].
    pub rest_speed: Vec<f64>,
    /// Greatest speed of each joint [m/s or rad/s].
    pub top_speed: Vec<f64>,
    /// Its first and last time, from where its times are counted [s].
    pub time_span: [f64; 2],
    /// Rate of a log whose rows are poses [Hz].
    pub poses_hz: Option<f64>,
    /// Part of the time at rest, of a log that holds pose after pose.
    pub held_share: Option<f64>,
    /// How many times the derivative of its position each joint's velocity column is, where it follows that.
    pub velocities: Vec<Option<f64>>,
    /// Takes out the rows that are marked bad.
    cutter: RowCutter,
    /// The robot by which motor forces of a zero-order hold are brought to the time and pose of their rows.
    hold: Option<Robot>,
    /// Subtracted from the torques of every row.
    torque_offset: Option<Arc<TorqueCourse>>,
}

impl Recording {
    /// Reads a part of a log, and looks at it. A file that one of the recordings beside it holds is not parsed again.
    ///
    /// # Errors
    /// A file that cannot be read, is no log, lacks a channel of the layout, or holds a row that cannot be used.
    pub fn read(spec: &LogSpec, request: &RecordingRequest) -> Result<Self, LogError> {
        let rows = |layout: &Layout| parsed(spec, layout, request);
        let found = Self::looked_at(rows(&request.layout)?, request)?;
        let temperatures = match &request.temperatures {
            Some((joints, layout)) => {
                JointTemperatures::read(spec, (joints, layout), found.origin())
            }
            None => Ok(JointTemperatures::default()),
        };
        Ok(Self {
            references: request.references.as_ref().map(rows),
            temperatures,
            ..found
        })
    }

    /// The same of a log in memory; the layout names its joints and says whether torques are read.
    ///
    /// # Errors
    /// Another number of channels than the layout has, and rows that cannot be used.
    pub fn of_arrays(
        arrays: &Arc<LogArrays>,
        request: &RecordingRequest,
    ) -> Result<Self, LogError> {
        let rows =
            |arrays: &Arc<LogArrays>, layout| RecordedRows::Arrays(Arc::clone(arrays), layout);
        let layout = &request.layout;
        let references = arrays.references();
        Ok(Self {
            references: references.map(|of| Ok(rows(of, layout.clone().without_torques()))),
            temperatures: Ok(arrays.temperatures()),
            ..Self::looked_at(rows(arrays, layout.clone()), request)?
        })
    }

    fn looked_at(rows: RecordedRows, request: &RecordingRequest) -> Result<Self, LogError> {
        let as_logged = rows.as_logged();
        let speeds = RefCell::new(SpeedMeter::new());
        let open = || {
            // Of a second reading, which mends what hides the rest, the speeds are right.
            speeds.replace(SpeedMeter::new());
            as_logged.reader()
        };
        let layout = rows.layout();
        let mut meter = |block: &Block, read: &Layout| {
            let layouts = [Some(layout), layout.otherwise.as_deref()];
            let declared = layouts.into_iter().flatten();
            let mut declared = declared.filter(|l| l.channels == read.channels);
            let conversion = declared.next().and_then(|l| l.conversion.as_ref());
            speeds.borrow_mut().take(block, conversion);
        };
        let inspection = InspectionGate::look(&open, request.keep, request.stop, &mut meter)?;
        let inspection = inspection.ok_or(LogError::Interrupted)?;
        let speeds = speeds.into_inner();
        Ok(Self {
            inspection,
            rest_speed: speeds.resting(),
            top_speed: speeds.fastest(),
            time_span: speeds.bounds(),
            poses_hz: speeds.poses_hz(),
            held_share: speeds.held_share(),
            velocities: speeds.velocities(),
            cutter: RowCutter::default(),
            hold: None,
            torque_offset: None,
            references: None,
            temperatures: Ok(JointTemperatures::default()),
            rows,
        })
    }

    /// The same with motor forces of a zero-order hold brought to the time and pose of their rows.
    pub fn held_by(self, robot: Robot) -> Self {
        let hold = Some(robot);
        Self { hold, ..self }
    }

    /// Time from its first to its last row [s].
    pub fn duration_s(&self) -> f64 {
        self.time_span[1] - self.time_span[0]
    }

    /// Whether torques come from a zero-order hold.
    pub fn is_held(&self) -> bool {
        self.hold.is_some()
    }

    /// Says whether the robot moves as without its motors where torques are exactly 0: if not, such rows are left out.
    pub fn set_swings_freely(&mut self, freely: bool) {
        self.inspection.set_freely(freely);
    }

    /// The same, rows that are marked bad taken out so that a step is left that parts it: one longer than `longest` has it for the median
    /// step \[s\].
    pub fn cut_by(self, longest: &dyn Fn(f64) -> f64) -> Self {
        Self {
            cutter: self.inspection.cutter(longest),
            ..self
        }
    }

    /// The same less the torques of a course.
    pub fn minus_torque(&self, course: TorqueCourse) -> Self {
        Self {
            torque_offset: Some(Arc::new(course)),
            ..self.clone()
        }
    }

    /// The same less the torques that are subtracted from another recording of its log.
    pub fn minus_torque_of(self, other: &Self) -> Self {
        Self {
            torque_offset: other.torque_offset.clone(),
            ..self
        }
    }

    /// The rows of its joints, torques at the time and pose of their rows.
    ///
    /// # Errors
    /// A file that can no longer be read.
    pub fn blocks(&self) -> Result<RowBlocks, LogError> {
        let hold = self.hold.as_ref();
        let with = |robot: &Robot| (robot.clone(), ZeroOrderHold::new(robot.joints()));
        Ok(RowBlocks {
            hold: hold.map(with),
            torque_offset: self.torque_offset.clone(),
            ..self.blocks_of(&self.rows)?
        })
    }

    /// The rows of its joints, torques as logged: each holds until the next row, or is of its own.
    ///
    /// # Errors
    /// A file that can no longer be read.
    pub fn held_blocks(&self) -> Result<RowBlocks, LogError> {
        self.blocks_of(&self.rows)
    }

    /// Its rows as they were logged, in SI units: motors' channels stay what they are.
    ///
    /// # Errors
    /// A file that can no longer be read.
    pub fn logged_blocks(&self) -> Result<RowBlocks, LogError> {
        self.blocks_of(&self.rows.as_logged())
    }

    fn blocks_of(&self, rows: &RecordedRows) -> Result<RowBlocks, LogError> {
        let mut reader = rows.reader()?;
        reader.mend(self.inspection.mending());
        Ok(RowBlocks {
            reader,
            cutter: self.cutter.clone(),
            hold: None,
            torque_offset: None,
            stop: None,
        })
    }

    /// The positions that the controller was asked for, row by row; none where none are known.
    ///
    /// # Errors
    /// A log that lacks a channel of them.
    pub fn references(&self) -> Result<Option<Reader>, LogError> {
        match &self.references {
            Some(Ok(rows)) => rows.reader().map(Some),
            Some(Err(error)) => Err(error.clone()),
            None => Ok(None),
        }
    }

    /// Temperatures of its joints.
    ///
    /// # Errors
    /// A log that lacks a channel of them, or one that is no number.
    pub fn temperatures(&self) -> Result<&JointTemperatures, LogError> {
        self.temperatures.as_ref().map_err(LogError::clone)
    }

    /// Name, span and checksum of its log, by which its rows are known from others.
    ///
    /// # Errors
    /// A file that can no longer be read.
    pub fn identity(&self) -> Result<Provenance, LogError> {
        self.rows.reader()?.provenance()
    }

    /// The layout that it turned out to have.
    pub fn layout(&self) -> &Layout {
        match &self.rows {
            RecordedRows::Parsed(_, store, _) => store.found(),
            RecordedRows::Arrays(_, layout) => layout,
        }
    }

    /// Names of columns of its log that `is_asked` takes, those of no channel among them, without those that are 0
    /// throughout; of a recording of the fields that are read.
    pub fn columns(&self, is_asked: &dyn Fn(&str) -> bool) -> Vec<String> {
        let RecordedRows::Parsed(spec, store, layout) = &self.rows else {
            return Vec::new();
        };
        let mut names: Vec<String> = store.names().to_vec();
        names.retain(|name| is_asked(name));
        // what comes through a pipe is not there a second time
        if !names.is_empty() && store.files().iter().all(|file| file.is_file()) {
            let zero = zero_throughout(spec, layout, &names).unwrap_or_default();
            names.retain(|name| !zero.contains(name));
        }
        names
    }

    /// The instant from which its times are counted.
    pub fn origin(&self) -> Instant {
        self.inspection.origin()
    }
}

/// The rows of a file, which one of the recordings beside may have.
fn parsed(
    spec: &LogSpec,
    layout: &Layout,
    request: &RecordingRequest,
) -> Result<RecordedRows, LogError> {
    let files = spec.files()?;
    let kept = request.beside.iter().find_map(|other| match &other.rows {
        RecordedRows::Parsed(_, store, _) => store.holds(&files, layout).then_some(store),
        RecordedRows::Arrays(..) => None,
    });
    let store = match kept {
        Some(store) => Arc::clone(store),
        None => Arc::new(RowStore::read(&files, layout, request.stop)?),
    };
    Ok(RecordedRows::Parsed(spec.clone(), store, layout.clone()))
}

/// Says whether reading is to end.
pub type StopCheck = dyn Fn() -> bool + Send + Sync;

/// One way along a recording.
pub struct RowBlocks {
    reader: Reader,
    cutter: RowCutter,
    hold: Option<(Robot, ZeroOrderHold)>,
    torque_offset: Option<Arc<TorqueCourse>>,
    stop: Option<Arc<StopCheck>>,
}

impl RowBlocks {
    /// The same, ended with [`LogError::Interrupted`] where `stop` says so; it is asked before each block.
    pub fn stopped_by(self, stop: Option<Arc<StopCheck>>) -> Self {
        Self { stop, ..self }
    }

    /// The next rows, none of them marked bad; false, and no row, at the end.
    ///
    /// # Errors
    /// A file that can no longer be read.
    pub fn read(&mut self, block: &mut Block) -> Result<bool, LogError> {
        loop {
            if self.stop.as_ref().is_some_and(|stop| stop()) {
                return Err(LogError::Interrupted);
            }
            let more = self.read_marked(block)?;
            if !more || !block.is_empty() {
                return Ok(more);
            }
        }
    }

    /// One block of the reader; empty where all its rows are marked bad.
    fn read_marked(&mut self, block: &mut Block) -> Result<bool, LogError> {
        let more = self.reader.read(block)?;
        if let Some((robot, hold)) = &mut self.hold {
            hold.centre(robot, block);
        }
        if block.tau.is_empty() {
            // a log without torques moves with none
            block.tau.resize(block.q.len(), 0.0);
        }
        if let Some(offset) = &self.torque_offset {
            offset.subtract_from(block);
        }
        self.cutter.cut(block);
        Ok(more)
    }

    /// What reads the rows, and what it left out.
    pub fn reader(&self) -> &Reader {
        &self.reader
    }

    /// Name, span, checksum and size of what was read so far.
    ///
    /// # Errors
    /// A file that can no longer be read.
    pub fn provenance(&self) -> Result<Provenance, LogError> {
        self.reader.provenance()
    }

    /// Rows that were taken out as bad so far.
    pub fn removed(&self) -> u64 {
        self.cutter.removed()
    }
}

/// Those of these columns of a log that hold zeros and no other number.
fn zero_throughout(
    spec: &LogSpec,
    layout: &Layout,
    names: &[String],
) -> Result<Vec<String>, LogError> {
    let mut raw = RawReader::open(spec, Some(layout))?;
    let place = |name: &String| raw.names().iter().position(|of| of == name);
    let places = names.iter().filter_map(|name| Some((place(name)?, name)));
    let mut zero: Vec<(usize, &String)> = places.collect();
    let mut block = RawBlock::default();
    // a column of no number at all may be anything
    let mut seen = vec![false; raw.names().len()];
    while !zero.is_empty() && raw.read(&mut block)? {
        zero.retain(|(column, _)| {
            let mut numbers = block.columns[*column].iter().filter(|x| !x.is_nan());
            seen[*column] |= numbers.clone().next().is_some();
            numbers.all(|x| *x == 0.0)
        });
    }
    let zero = zero.into_iter().filter(|(column, _)| seen[*column]);
    Ok(zero.map(|(_, name)| name.clone()).collect())
}
