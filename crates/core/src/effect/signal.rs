//! Signals of a joint that a curve is drawn over.

/// What the curve is drawn over.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CurveSignal {
    /// A torque over the position.
    Position,
    /// Friction over the position: it flips with the direction.
    Friction,
    /// A torque over the speed.
    Speed,
    /// Friction over the load torque.
    Load,
    /// Friction over the way since the joint last reversed.
    Way,
}

/// In the order of their numbers in files, from 1, as they are declared.
const ALL: [CurveSignal; 5] = [
    CurveSignal::Position,
    CurveSignal::Friction,
    CurveSignal::Speed,
    CurveSignal::Load,
    CurveSignal::Way,
];

/// How many there are.
pub(super) const SIGNALS: usize = ALL.len();

impl CurveSignal {
    pub(super) fn of(number: f64) -> CurveSignal {
        let index = (number.round() as usize).clamp(1, ALL.len());
        ALL[index - 1]
    }

    /// What it is and what to look at: `torque that depends on its position`, `a cable, a hose or the sensor`.
    pub fn words(self) -> [&'static str; 2] {
        match self {
            CurveSignal::Position => [
                "torque that depends on its position",
                "a cable, a hose or the sensor",
            ],
            CurveSignal::Friction => [
                "friction that depends on its position",
                "a bent screw, an eccentric gear or a seal",
            ],
            CurveSignal::Speed => [
                "torque that depends on its speed",
                "a lubricant, or a friction law that is not in the catalogue",
            ],
            CurveSignal::Load => [
                "friction that depends on its load",
                "gear teeth, bearings or the torque sensor",
            ],
            CurveSignal::Way => [
                "friction that depends on the way since it last reversed",
                "play, presliding or a shaft that twists",
            ],
        }
    }

    /// The shape of the law over it.
    pub fn shape(self, [from, to]: [f64; 2]) -> Vec<f64> {
        vec![f64::from(self as u8 + 1), from, to]
    }
}
