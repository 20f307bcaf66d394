//! The page of the studies: its tables are made from the runs, between `<!-- study: NAME -->` and
//! `<!-- end of study -->`.

use std::path::Path;

use crate::study::{Rows, StudyError};
use crate::{
    clean, coverage, formula, kinds, next_motion, nulls, payload, planted, rotations, setup,
};

/// The page with the tables of all runs in a folder of results; a study without runs keeps what stands there.
pub fn rendered(page: &Path, results: &Path) -> Result<String, StudyError> {
    let mut text = crate::files::read(page)?;
    for (name, table) in [
        ("coverage", coverage::table as fn(&Rows) -> String),
        ("clean", clean::table),
        ("planted", planted::table),
        ("kinds", kinds::table),
        ("nulls", nulls::table),
        ("rotations", rotations::table),
        ("formula", formula::table),
        ("setup", setup::table),
        ("next", next_motion::table),
        ("payload", payload::table),
    ] {
        let rows = Rows::open(results, &format!("independent_{name}"))?;
        if !rows.rows.is_empty() {
            text = filled(page, &text, name, &table(&rows))?;
        }
    }
    Ok(text)
}

fn filled(page: &Path, whole: &str, name: &str, table: &str) -> Result<String, StudyError> {
    const END: &str = "<!-- end of study -->";
    let mark = format!("<!-- study: {name} -->");
    let (before, rest) = whole.split_once(&mark).ok_or_else(|| StudyError::NoPlace {
        path: page.to_owned(),
        mark: mark.clone(),
    })?;
    let (_, after) = rest.split_once(END).ok_or_else(|| StudyError::NoPlace {
        path: page.to_owned(),
        mark: mark.clone(),
    })?;
    Ok(format!(
        "{before}{mark}\n\n{}\n\n{END}{after}",
        table.trim()
    ))
}
