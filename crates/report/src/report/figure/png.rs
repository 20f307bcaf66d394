//! A figure as PNG: the SVG drawn in pixels, with the fonts that come with the crate, so that it looks
//! the same on every machine.

use cft_ident_core::explain::Explain;
use std::sync::{Arc, OnceLock};

use resvg::tiny_skia::{Pixmap, Transform};
use resvg::usvg::fontdb::Database;
use resvg::usvg::{Options, Tree};

const REGULAR_FONT: &[u8] = include_bytes!("font/DejaVuSans.ttf");
const BOLD: &[u8] = include_bytes!("font/DejaVuSans-Bold.ttf");

/// Pixels for one px of the figure: 300 dots an inch where a figure of 760 px is printed 19 cm wide.
const SCALE: f32 = 3.0;

/// Why there is no picture.
#[derive(Debug, Explain, thiserror::Error)]
pub enum PngError {
    #[explain("the figure cannot be read back: {_0}", "write it as .svg")]
    Figure(#[from] resvg::usvg::Error),
    #[explain(
        "a picture of {width} x {height} px does not fit into memory",
        "write it as .svg"
    )]
    Size { width: u32, height: u32 },
    #[explain("the picture cannot be encoded: {_0}", "write it as .svg")]
    Encoding(String),
}

fn fonts() -> Arc<Database> {
    static FONTS: OnceLock<Arc<Database>> = OnceLock::new();
    let fonts = FONTS.get_or_init(|| {
        let mut fonts = Database::new();
        fonts.load_font_data(REGULAR_FONT.to_vec());
        fonts.load_font_data(BOLD.to_vec());
        fonts.set_sans_serif_family("DejaVu Sans");
        Arc::new(fonts)
    });
    Arc::clone(fonts)
}

/// An SVG document of this crate as a PNG file.
///
/// # Errors
/// [`PngError`]; a figure of this crate that fits into memory gives none.
pub fn png(svg: &str) -> Result<Vec<u8>, PngError> {
    let options = Options {
        fontdb: fonts(),
        font_family: "DejaVu Sans".into(),
        ..Options::default()
    };
    let tree = Tree::from_str(svg, &options)?;
    let size = tree.size();
    let [width, height] = [size.width(), size.height()].map(|x| (x * SCALE).ceil() as u32);
    let mut pixels = Pixmap::new(width, height).ok_or(PngError::Size { width, height })?;
    let scale = Transform::from_scale(SCALE, SCALE);
    resvg::render(&tree, scale, &mut pixels.as_mut());
    let encoded = pixels.encode_png();
    encoded.map_err(|e| PngError::Encoding(e.to_string()))
}

#[cfg(test)]
mod tests {
    use super::super::svg::{LineStroke, SvgPicture, TextAnchor, TextStyle};
    use super::*;

    /// Pixels of a text in a figure of 100 x 20 px that are not white.
    fn inked(text: &str, bold: bool) -> usize {
        let mut svg = SvgPicture::new(100.0, 20.0, "t", "");
        let style = TextStyle::new(12.0, TextAnchor::Start);
        let style = if bold { style.bold() } else { style };
        svg.text([2.0, 15.0], text, style);
        let picture = png(&svg.finish()).unwrap();
        let pixels = Pixmap::decode_png(&picture).unwrap();
        assert_eq!((pixels.width(), pixels.height()), (300, 60));
        let ink = |p: &&resvg::tiny_skia::PremultipliedColorU8| p.red() < 128;
        pixels.pixels().iter().filter(ink).count()
    }

    #[test]
    fn words_are_drawn_with_the_fonts_of_the_crate() {
        let plain = inked("torque", false);
        assert!(plain > 400, "{plain}");
        assert!(inked("torque", true) > plain * 5 / 4);
        assert_eq!(inked("", false), 0);
        // minus, superscript, an em space, Greek and Cyrillic have shapes of their own
        for sign in [
            "\u{2212}", "\u{b2}", "\u{2076}", "\u{3b8}", "\u{436}", "\u{2026}",
        ] {
            let ink = inked(sign, false);
            assert!(ink > 10 && ink != inked("\u{4e2d}", false), "{sign}: {ink}");
        }
    }

    #[test]
    fn the_same_figure_gives_the_same_bytes() {
        let draw = || {
            let mut svg = SvgPicture::new(80.0, 40.0, "a & b", "");
            svg.curve(
                &[vec![[1.0, 2.0], [70.0, 30.0]]],
                LineStroke::dashed("#0072b2", 1.0, "4 3"),
            );
            png(&svg.finish()).unwrap()
        };
        assert!(draw() == draw());
        assert!(draw().starts_with(b"\x89PNG"));
    }
}
