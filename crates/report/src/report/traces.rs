//! Series over time for the viewer of a page, thinned so that every extreme survives and the page
//! stays small.

use serde::Serialize;
use serde_json::{Value, json};

use super::encode;

/// Most bytes of the numbers of a figure: 60 s at 1 kHz of four joints, measured, by two models and both residuals.
const MOST_BYTES: usize = 2_700_000;

/// How a line is drawn.
#[derive(Debug, Clone, Copy, Serialize)]
#[serde(rename_all = "lowercase")]
pub(crate) enum TraceStyle {
    Measured,
    Model,
    Residual,
    Before,
    After,
    Motion,
}

/// One line of a panel.
#[derive(Debug, Clone)]
pub(crate) struct TraceLine {
    pub name: String,
    pub style: TraceStyle,
    /// One value per time of the trace; a gap where it is not finite.
    pub values: Vec<f64>,
}

/// One panel: lines that share an axis.
#[derive(Debug, Clone)]
pub(crate) struct TracePanel {
    /// Joint or coordinate; empty where the panel above has it.
    pub name: String,
    pub quantity: String,
    pub unit: String,
    /// Low and centred on 0, below the panel that it belongs to: a residual.
    pub small: bool,
    pub limits: Option<[f64; 2]>,
    pub lines: Vec<TraceLine>,
}

/// One log in one form, of which a page shows one at a time.
#[derive(Debug)]
pub(crate) struct LogTrace {
    /// Name in the list of traces.
    pub name: String,
    /// Time [s], rising.
    pub t: Vec<f64>,
    /// First samples of stretches that no line joins with those before.
    pub breaks: Vec<usize>,
    pub panels: Vec<TracePanel>,
}

/// The traces of one figure; the first is shown first.
#[derive(Debug)]
pub(crate) struct FigureTraces {
    /// For a screen reader.
    pub label: String,
    /// Traces with the same lines.
    pub traces: Vec<LogTrace>,
}

impl FigureTraces {
    /// The data as the viewer reads them, safe inside a script element.
    pub(super) fn data(&self) -> String {
        let most = self.most_samples();
        let views: Vec<Value> = self.traces.iter().map(|t| t.view(most)).collect();
        let data = json!({"label": self.label, "over": "time", "unit": "s", "views": views});
        // inside a script element the end tag alone has a meaning; no `<` is left at all
        data.to_string().replace('<', "\\u003c")
    }

    /// Samples that a trace may have for all of them to fit.
    fn most_samples(&self) -> usize {
        let longest = self.traces.iter().map(|t| t.t.len()).max().unwrap_or(0);
        let size = |t: &LogTrace, most| t.t.len().min(most) * (4 + 2 * t.lines().count());
        let bytes = |most: usize| self.traces.iter().map(|t| size(t, most)).sum::<usize>();
        let mut most = longest;
        while bytes(most) > MOST_BYTES && most > 16 {
            most = most / 10 * 9;
        }
        most
    }
}

impl LogTrace {
    fn lines(&self) -> impl Iterator<Item = &TraceLine> {
        self.panels.iter().flat_map(|panel| &panel.lines)
    }

    fn view(&self, most: usize) -> Value {
        let buckets = TraceBuckets::of(self.t.len(), &self.breaks, most);
        let (t, [from, to]) = encode::times(&buckets.times(&self.t));
        let line = |line: &TraceLine| {
            let (data, [from, to]) = encode::values(&buckets.extremes(&line.values));
            json!({"name": line.name, "style": line.style, "from": from, "to": to, "data": data})
        };
        let panel = |panel: &TracePanel| {
            json!({
                "name": panel.name,
                "quantity": panel.quantity,
                "unit": panel.unit,
                "small": panel.small,
                "limits": panel.limits,
                "lines": panel.lines.iter().map(line).collect::<Vec<_>>(),
            })
        };
        json!({
            "name": self.name,
            "t": {"from": from, "to": to, "data": t},
            "breaks": buckets.breaks(),
            "panels": self.panels.iter().map(panel).collect::<Vec<_>>(),
        })
    }
}

/// Runs of consecutive samples, each to become at most two, none across a break.
struct TraceBuckets {
    /// First sample of each and the end of the last.
    bounds: Vec<usize>,
    /// Buckets that begin a stretch.
    begins: Vec<usize>,
    /// Every sample is a bucket of its own.
    whole: bool,
}

impl TraceBuckets {
    fn of(samples: usize, breaks: &[usize], most: usize) -> Self {
        let whole = samples <= most;
        let size = match whole {
            true => 1,
            false => (2 * samples).div_ceil(most.max(2)),
        };
        let mut stretches: Vec<usize> = breaks.iter().copied().filter(|b| *b < samples).collect();
        stretches.extend([0, samples]);
        stretches.sort_unstable();
        stretches.dedup();
        let (mut bounds, mut begins) = (Vec::new(), Vec::new());
        for pair in stretches.windows(2) {
            begins.push(bounds.len());
            bounds.extend((pair[0]..pair[1]).step_by(size));
        }
        bounds.push(samples);
        TraceBuckets {
            bounds,
            begins,
            whole,
        }
    }

    fn ranges(&self) -> impl Iterator<Item = std::ops::Range<usize>> {
        self.bounds.windows(2).map(|pair| pair[0]..pair[1])
    }

    /// First sample of each stretch among those that are left.
    fn breaks(&self) -> Vec<usize> {
        let each = if self.whole { 1 } else { 2 };
        self.begins.iter().map(|b| each * b).collect()
    }

    /// Two values for each bucket, where not every sample is one.
    fn thinned(&self, values: &[f64], both: impl Fn(&[f64]) -> [f64; 2]) -> Vec<f64> {
        if self.whole {
            return values.to_vec();
        }
        let buckets = self
            .ranges()
            .map(|range| values.get(range).unwrap_or_default());
        buckets.flat_map(both).collect()
    }

    fn times(&self, t: &[f64]) -> Vec<f64> {
        self.thinned(t, |bucket| {
            [bucket.first(), bucket.last()].map(|t| t.copied().unwrap_or(0.0))
        })
    }

    /// The smallest and the largest of each bucket, in their order.
    fn extremes(&self, values: &[f64]) -> Vec<f64> {
        self.thinned(values, |bucket| {
            let finite = bucket.iter().enumerate().filter(|(_, v)| v.is_finite());
            let low = finite.clone().min_by(|a, b| a.1.total_cmp(b.1));
            let high = finite.max_by(|a, b| a.1.total_cmp(b.1));
            match low.zip(high) {
                Some((low, high)) if low.0 <= high.0 => [*low.1, *high.1],
                Some((low, high)) => [*high.1, *low.1],
                None => [f64::NAN; 2],
            }
        })
    }
}

#[cfg(test)]
impl FigureTraces {
    /// Two samples, every word of it `text`.
    pub(super) fn sample(text: &str) -> Self {
        let line = TraceLine {
            name: text.into(),
            style: TraceStyle::Measured,
            values: vec![1.0, 2.0],
        };
        let panel = TracePanel {
            name: text.into(),
            quantity: text.into(),
            unit: text.into(),
            small: false,
            limits: None,
            lines: vec![line],
        };
        FigureTraces {
            label: text.into(),
            traces: vec![LogTrace {
                name: text.into(),
                t: vec![0.0, 1.0],
                breaks: vec![0],
                panels: vec![panel],
            }],
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_spike_of_one_sample_survives_and_no_bucket_crosses_a_break() {
        let mut values: Vec<f64> = (0..1000).map(|k| f64::from(k) * 1e-3).collect();
        values[333] = 9.0;
        values[700] = -9.0;
        values[20..40].fill(f64::NAN);
        let buckets = TraceBuckets::of(1000, &[0, 501], 100);
        assert!(buckets.ranges().all(|r| r.end <= 501 || r.start >= 501));
        let t: Vec<f64> = (0..1000).map(f64::from).collect();
        let thinned = buckets.extremes(&values);
        assert_eq!(thinned.len(), buckets.times(&t).len());
        assert!(thinned.len() <= 104, "{}", thinned.len());
        assert!(thinned.contains(&9.0) && thinned.contains(&-9.0));
        assert!(thinned[2].is_nan() && thinned[0] == 0.0);
        let second = buckets.breaks()[1];
        assert_eq!(buckets.times(&t)[second], 501.0);
        assert!(buckets.times(&t).is_sorted());
    }

    #[test]
    fn a_minute_of_four_joints_is_kept_whole_and_an_hour_still_fits() {
        let of = |samples: usize| {
            let mut traces = FigureTraces::sample("q");
            let trace = &mut traces.traces[0];
            trace.t = (0..samples).map(|k| k as f64).collect();
            let panel = &mut trace.panels[0];
            panel.lines[0].values = vec![0.5; samples];
            panel.lines = vec![panel.lines[0].clone(); 5];
            trace.panels = vec![trace.panels[0].clone(); 4];
            traces
        };
        let minute = of(60_001);
        assert_eq!(minute.most_samples(), 60_001);
        assert!(minute.data().len() < 3_700_000, "{}", minute.data().len());
        let hour = of(400_000).data();
        assert!(hour.len() < 3_700_000, "{}", hour.len());
    }

    #[test]
    fn words_from_a_file_cannot_leave_the_script_element() {
        let data = FigureTraces::sample("</script><!--").data();
        assert!(!data.contains('<'));
        let back: Value = serde_json::from_str(&data).unwrap();
        assert_eq!(back["views"][0]["panels"][0]["name"], "</script><!--");
    }
}
