//! Groups of rows that tell another story than all others: poses in which somebody leans on the arm, and the like.

/// The numbers that decide whether groups of rows are set aside.
struct SetAsideNumbers {
    /// Part of the groups that may be set aside at most: what holds for more is no touch. Half: a touch of three poses in
    /// twenty-four stays in; twice: a model that lacks something loses the rows that show it.
    most: f64,
    /// Deviations of the others from which on a group is set aside. Half: noise is; twice: touches of nine times the
    /// noise stay in.
    far: f64,
    /// Part of the error with a group that may be left without it. Half: one touched pose in twenty-four stays in;
    /// twice: the tails of any residual are set aside.
    left: f64,
}

const NUMBERS: SetAsideNumbers = SetAsideNumbers {
    most: 0.2,
    far: 5.0,
    left: 2.0 / 3.0,
};

/// What a fit leaves of a group of rows in one channel: a joint, a force.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct GroupError {
    /// Sum of the squared errors.
    pub square: f64,
    /// What that sum is expected to be, in variances of the channel: a fit leaves less of rows that it is made of than of
    /// others. 0 where the group has no row of the channel.
    pub expected: f64,
}

/// What the groups that are kept say of a channel.
struct ChannelSpread {
    /// Deviation of its errors.
    std: f64,
    /// Numbers that this deviation is made of.
    freedom: f64,
}

impl ChannelSpread {
    /// Of every channel.
    fn of_each(errors: &[Vec<GroupError>], kept: &[bool]) -> Vec<Self> {
        let channels = errors.iter().map(Vec::len).max().unwrap_or_default();
        let of = |c: usize| {
            let own = || errors.iter().zip(kept).filter(|(_, kept)| **kept);
            let sum = |of: &dyn Fn(&GroupError) -> f64| own().map(|(e, _)| of(&e[c])).sum::<f64>();
            let expected = sum(&|of| of.expected).max(f64::MIN_POSITIVE);
            Self {
                std: (sum(&|of| of.square) / expected)
                    .sqrt()
                    .max(f64::MIN_POSITIVE),
                freedom: expected.min(own().count() as f64),
            }
        };
        (0..channels).map(of).collect()
    }

    /// How far a group is from the others, in deviations of a normal number that is as rare: few others say little of
    /// their own deviation (Student 1908, by the approximation z^2 = n ln(1 + t^2 / n)).
    fn deviations(&self, of: &GroupError) -> f64 {
        let square = of.square / of.expected / (self.std * self.std);
        (self.freedom * (square / self.freedom).ln_1p()).sqrt()
    }
}

/// How far each group is from the others, in the channel in which that is most.
fn distances(errors: &[Vec<GroupError>], kept: &[bool]) -> Vec<f64> {
    let all = ChannelSpread::of_each(errors, kept);
    let of = |group: &Vec<GroupError>| {
        let each = group.iter().zip(&all).filter(|(of, _)| of.expected > 0.0);
        each.map(|(of, spread)| spread.deviations(of))
            .fold(0.0, f64::max)
    };
    errors.iter().map(of).collect()
}

/// Which groups of rows belong together, where a few do not: a fit to those that are kept leaves little of each of them and
/// much of each other one. None where all belong, and where more than a fifth would not: then the model is at fault.
///
/// `left_by` gives what a fit to the groups that are kept leaves of every group, channel by channel; none where they do not
/// suffice for a fit.
pub fn kept_groups(
    count: usize,
    mut left_by: impl FnMut(&[bool]) -> Option<Vec<Vec<GroupError>>>,
) -> Option<Vec<bool>> {
    let most = (NUMBERS.most * count as f64) as usize;
    let mut tried = vec![true; count];
    let mut errors = left_by(&tried)?;
    let mut before = ChannelSpread::of_each(&errors, &tried);
    let mut parted = None;
    for _ in 0..most {
        let away = distances(&errors, &tried);
        let within = (0..count).filter(|k| tried[*k]);
        let worst = within.max_by(|a, b| away[*a].total_cmp(&away[*b]))?;
        tried[worst] = false;
        errors = left_by(&tried)?;
        let away = distances(&errors, &tried);
        // one that was left out in passing comes back, and is not to be far from the others then
        let groups = tried.iter().zip(&away);
        let kept: Vec<bool> = groups
            .map(|(tried, away)| *tried || *away <= NUMBERS.far)
            .collect();
        if kept.iter().all(|kept| *kept) {
            continue;
        }
        let left = left_by(&kept)?;
        let away = distances(&left, &kept);
        let mut groups = kept.iter().zip(&away);
        let are_apart = groups.all(|(kept, away)| *kept == (*away <= NUMBERS.far));
        let now = ChannelSpread::of_each(&left, &kept);
        let mut channels = now.iter().zip(&before);
        if are_apart && channels.any(|(now, before)| now.std < NUMBERS.left * before.std) {
            // one of two that are far may hide behind the other: more may follow
            (parted, before) = (Some(kept), now);
        }
    }
    parted
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The kept groups of numbers of one channel whose fit is their mean.
    fn kept_of(numbers: &[f64]) -> Option<Vec<bool>> {
        kept_groups(numbers.len(), |kept| {
            let own = || numbers.iter().zip(kept).filter(|(_, kept)| **kept);
            let count = own().count() as f64;
            let mean = own().map(|(x, _)| x).sum::<f64>() / count;
            let of = |(x, kept): (&f64, &bool)| {
                let expected = if *kept {
                    1.0 - 1.0 / count
                } else {
                    1.0 + 1.0 / count
                };
                vec![GroupError {
                    square: (x - mean).powi(2),
                    expected,
                }]
            };
            Some(numbers.iter().zip(kept).map(of).collect())
        })
    }

    /// Numbers of mean 0 and deviation 1, in disorder.
    fn noise(seed: u64, count: usize) -> Vec<f64> {
        let mut state = seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) | 1;
        let mut next = || {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            (state >> 33) as f64 / f64::from(1u32 << 31)
        };
        let mut normal = || (0..12).map(|_| next()).sum::<f64>() - 6.0;
        (0..count).map(|_| normal()).collect()
    }

    #[test]
    fn numbers_that_belong_together_are_kept_and_those_far_from_them_are_set_aside() {
        for seed in 0..200 {
            for count in [8, 24, 96] {
                let mut numbers = noise(seed, count);
                assert_eq!(kept_of(&numbers), None, "{seed} {count}");
                let apart = [count / 3, count / 3 + count / 8];
                apart.iter().for_each(|k| numbers[*k] += 12.0);
                let kept = kept_of(&numbers);
                let aside: Option<Vec<usize>> =
                    kept.map(|kept| (0..count).filter(|k| !kept[*k]).collect());
                match count {
                    // two of eight are more than a fifth
                    8 => assert_eq!(aside, None, "{seed}"),
                    _ => assert_eq!(aside, Some(apart.to_vec()), "{seed} {count}"),
                }
            }
        }
    }

    #[test]
    fn numbers_that_all_disagree_are_all_kept() {
        for seed in 0..200 {
            let wide: Vec<f64> = noise(seed, 24).iter().map(|x| 30.0 * x).collect();
            assert_eq!(kept_of(&wide), None);
            // a third of them tells another story
            let mut numbers = noise(seed, 24);
            numbers[8..16].iter_mut().for_each(|x| *x += 12.0);
            assert_eq!(kept_of(&numbers), None, "{seed}");
        }
    }
}
