//! What decides which terms are written because they predict, though none of them is sure by itself.

/// The numbers that decide.
#[derive(Debug, Clone, Copy)]
pub struct PredictionNumbers {
    /// A term takes so many standard errors off its joint's error on blocks left out, and another joint loses no more.
    /// Half: what chance finds is left to the shrinkage alone; 3 gains nothing.
    pub errors: f64,
    /// It takes this part off its joint's rms there, and another joint loses no more. Half: terms that no one sees;
    /// twice: as `noticeable`, what is named.
    pub part: f64,
    /// Deviations at which an amplitude is nil: it is written times max(0, 1 - nil^2 / F), F with the few blocks that
    /// hold its information made up for. Not at all: one joint in four gets worse on other logs; 5: what is
    /// named is all that is written.
    pub nil: f64,
    /// Most terms of a joint beside those that are named. Half: ripples of one drive take each other's place;
    /// twice: the last ones shrink to nothing.
    pub of_a_joint: usize,
    /// With fewer independent blocks nothing is written for prediction. Half: two blocks decide; twice: logs of half a
    /// minute gain nothing.
    pub least_blocks: usize,
}

/// The numbers of `diagnose`.
pub const PREDICTION_NUMBERS: PredictionNumbers = PredictionNumbers {
    errors: 2.0,
    part: 0.01,
    nil: 3.0,
    of_a_joint: 6,
    least_blocks: 6,
};
