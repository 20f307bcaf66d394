//! How soon changes are found: the share of them over the logs since, a line for each size.

use super::colour;
use super::joint_grid;
use super::legend::Key;
use super::panel::PlotPanel;
use super::svg::{LineStroke, SvgPicture, fitted};

/// Changes of one kind.
#[derive(Debug, Clone, PartialEq)]
pub struct RatePanel {
    pub name: String,
    /// Share that is found within 0, 1, .. logs, for each name of the figure.
    pub lines: Vec<Vec<f64>>,
}

/// A figure of one panel per kind, two beside each other.
#[derive(Debug, Clone, PartialEq)]
pub struct RateFigure {
    pub title: String,
    /// A name for each line; four at most.
    pub names: Vec<String>,
    pub panels: Vec<RatePanel>,
}

/// Distinguished by dashes as well as by colour.
const STROKES: [LineStroke; 4] = [
    LineStroke::dashed(colour::SKY, 1.6, "2 3"),
    LineStroke::solid(colour::BLUE, 1.8),
    LineStroke::dashed(colour::VERMILLION, 1.6, "7 3"),
    LineStroke::dashed(colour::INK, 1.4, "9 3 2 3"),
];

impl RateFigure {
    /// The figure as an SVG document.
    pub fn svg(&self) -> String {
        let keys = STROKES.iter().zip(&self.names);
        let legend: Vec<(Key, &str)> = keys
            .map(|(stroke, name)| (Key::Line(*stroke), name.as_str()))
            .collect();
        let panels: Vec<&str> = self.panels.iter().map(|p| p.name.as_str()).collect();
        let description = format!(
            "Share of changes found over the logs since, of {}; {}",
            self.names.join(", "),
            panels.join("; ")
        );
        let titles = [&*self.title, &description];
        joint_grid::draw(titles, &legend, &self.panels, RatePanel::draw)
    }
}

impl RatePanel {
    fn draw(&self, svg: &mut SvgPicture, frame: [f64; 4]) {
        let [left, top, width, _] = frame;
        let name = fitted(&self.name, 11.5, width);
        svg.heading([left, top - 7.0], &name, "");
        let longest = self.lines.iter().map(Vec::len).max().unwrap_or_default();
        if longest < 2 {
            PlotPanel::empty(svg, frame, "no changes");
            return;
        }
        let panel = PlotPanel::new(frame, [0.0, (longest - 1) as f64], [0.0, 100.0], [5, 5]);
        panel.grid(svg);
        for (line, stroke) in self.lines.iter().zip(STROKES) {
            let points = line.iter().enumerate();
            let points = points.map(|(k, share)| [k as f64, 100.0 * share]);
            svg.curve(&panel.place(vec![points.collect()]), stroke);
        }
        panel.axes(svg, 46.0, ["since the change", "logs"], ["found", "%"]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_size_has_a_line_of_its_own() {
        let panel = |name: &str, lines| RatePanel {
            name: name.into(),
            lines,
        };
        let lines = vec![vec![0.0, 0.5, 0.9], vec![0.0, 1.0, 1.0]];
        let figure = RateFigure {
            title: "found".into(),
            names: vec!["10 %".into(), "20 %".into()],
            panels: vec![panel("step", lines), panel("ramp", Vec::new())],
        };
        let svg = figure.svg();
        assert!(svg.contains("20 %") && svg.contains("no changes") && !svg.contains("NaN"));
        for stroke in &STROKES[..2] {
            assert!(svg.matches(stroke.colour).count() >= 2, "{svg}");
        }
    }
}
