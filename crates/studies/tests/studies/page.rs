//! The page says what the results hold.

use std::path::Path;

use cft_ident_studies::page::rendered;

#[test]
fn the_tables_of_the_page_are_those_of_the_runs() {
    let docs = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs");
    let page = docs.join("independent.md");
    let made = rendered(&page, &docs.join("results")).unwrap();
    let held = std::fs::read_to_string(page).unwrap();
    assert!(
        made == held,
        "docs/independent.md: make its tables anew with `studies tables`"
    );
}
