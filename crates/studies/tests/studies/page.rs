//! The page says what the results hold.

use std::path::Path;

use cft_ident_studies::page::rendered;

#[test]
fn the_tables_of_the_page_are_those_of_the_runs() {
    let results = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/results");
    let page = results.join("independent.md");
    let made = rendered(&page, &results).unwrap();
    let held = std::fs::read_to_string(page).unwrap();
    assert!(
        made == held,
        "docs/results/independent.md: make its tables anew with `studies tables`"
    );
}
