//! One self-contained page: headings, paragraphs, tables and SVG figures in one HTML file that opens
//! from disk, on paper and on a phone, in light and in dark, without a network and without a script.

use std::fmt::Write;

/// A page under construction. Every text that is given is escaped.
#[derive(Debug, Clone)]
pub struct Page {
    title: String,
    body: String,
}

const STYLE: &str = "\
:root{color-scheme:light dark;--ink:#222;--paper:#fff;--line:#ccc;--soft:#f4f6f1}\
@media(prefers-color-scheme:dark){:root{--ink:#e6e6e6;--paper:#181a1b;--line:#444;--soft:#23272a}}\
body{font:15px/1.5 Helvetica,Arial,'Liberation Sans','DejaVu Sans',sans-serif;color:var(--ink);\
background:var(--paper);max-width:900px;margin:0 auto;padding:1rem}\
h1{font-size:1.5rem}h2{font-size:1.15rem;border-bottom:1px solid var(--line);margin-top:2rem}\
p.verdict{font-size:1.15rem;background:var(--soft);border-left:4px solid #0072b2;padding:.6rem .8rem}\
div.wide{overflow-x:auto}table{border-collapse:collapse;margin:.6rem 0}\
caption{text-align:left;font-weight:bold;padding:.2rem 0}\
th,td{border-bottom:1px solid var(--line);padding:.2rem .7rem;text-align:right;white-space:nowrap}\
th:first-child,td:first-child,td.text{text-align:left;white-space:normal}\
figure{margin:1rem 0;overflow-x:auto;background:#fff}figure svg{max-width:100%;height:auto}\
pre{overflow-x:auto;background:var(--soft);padding:.6rem}\
@media print{body{max-width:none}figure,table{break-inside:avoid}}";

impl Page {
    /// An empty page.
    pub fn new(title: &str) -> Self {
        let mut page = Page {
            title: escaped(title),
            body: String::new(),
        };
        let _ = writeln!(page.body, "<h1>{}</h1>", page.title);
        page
    }

    /// The verdict in words.
    pub fn verdict(&mut self, text: &str) {
        let _ = writeln!(self.body, "<p class=\"verdict\">{}</p>", escaped(text));
    }

    /// A heading.
    pub fn heading(&mut self, text: &str) {
        let _ = writeln!(self.body, "<h2>{}</h2>", escaped(text));
    }

    /// A paragraph.
    pub fn paragraph(&mut self, text: &str) {
        let _ = writeln!(self.body, "<p>{}</p>", escaped(text));
    }

    /// A table; the first column holds names.
    pub fn table(&mut self, caption: &str, head: &[&str], rows: &[Vec<String>]) {
        let _ = write!(
            self.body,
            "<div class=\"wide\"><table><caption>{}</caption><thead><tr>",
            escaped(caption)
        );
        for name in head {
            let _ = write!(self.body, "<th scope=\"col\">{}</th>", escaped(name));
        }
        self.body.push_str("</tr></thead><tbody>\n");
        for row in rows {
            self.body.push_str("<tr>");
            for cell in row {
                let words = cell.chars().filter(|c| c.is_alphabetic()).count() > 12;
                let class = if words { " class=\"text\"" } else { "" };
                let _ = write!(self.body, "<td{class}>{}</td>", escaped(cell));
            }
            self.body.push_str("</tr>\n");
        }
        self.body.push_str("</tbody></table></div>\n");
    }

    /// A figure: an SVG document of this crate, its words escaped where it was drawn.
    pub fn figure(&mut self, svg: &str) {
        // inside HTML the XML declaration is not wanted
        let start = svg.find("<svg").unwrap_or(0);
        let _ = writeln!(self.body, "<figure>{}</figure>", &svg[start..]);
    }

    /// The page as a file.
    pub fn html(&self) -> String {
        format!(
            "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">\n\
             <meta name=\"viewport\" content=\"width=device-width,initial-scale=1\">\n\
             <title>{}</title><style>{STYLE}</style></head><body>\n{}</body></html>\n",
            self.title, self.body
        )
    }
}

/// Text as HTML may hold it.
fn escaped(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            '\'' => out.push_str("&#39;"),
            c if c.is_control() && c != '\n' => out.push('\u{fffd}'),
            c => out.push(c),
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_that_is_given_becomes_markup() {
        let evil = "<script>alert('x')</script>";
        let mut page = Page::new(evil);
        page.verdict(evil);
        page.heading(evil);
        page.paragraph(evil);
        page.table(evil, &[evil], &[vec![evil.to_owned()]]);
        let html = page.html();
        assert!(!html.contains("<script"));
        assert_eq!(html.matches("&lt;script&gt;").count(), 8);
    }
}
