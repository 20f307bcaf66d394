//! The table of the study.

use serde_json::Value;

use super::{Case, cells};
use crate::judge::{LIMITS, Share};
use crate::study::Rows;

/// Whether the last words of a refusal are about the robot file.
fn said_of_setup(row: &Value) -> bool {
    let said = row["said"].as_str().unwrap_or_default();
    ["as-declared", "robot file"]
        .iter()
        .any(|word| said.contains(word))
}

pub fn table(rows: &Rows) -> String {
    let mut text = String::from(
        "| case | build | logs | refused | warned | named | an estimate or undecidable | misnamed | silent |\n| :-- | :-- | --: | --: | --: | --: | --: | --: | --: |\n",
    );
    let mut heads = Vec::new();
    for tool in rows.tools() {
        let mut right = [0, 0, 0];
        let mut wrong = [0, 0, 0, 0];
        for cell in cells() {
            let own: Vec<&Value> = rows.of(&tool, cell.name()).collect();
            if own.is_empty() {
                continue;
            }
            let count = |of: &dyn Fn(&Value) -> bool| own.iter().filter(|r| of(r)).count();
            // a log may be refused for another reason, and then has no such entry
            let of_setup = |r: &Value| {
                let all = r["setup"].as_array().map_or(&[][..], Vec::as_slice);
                let right = matches!(cell.case, Case::Right(_));
                !right || all.is_empty() && said_of_setup(r) || all.iter().any(|s| s[5] == "error")
            };
            let refused = count(&|r| r["exit"] == 3 && of_setup(r));
            if matches!(cell.case, Case::Right(_)) {
                let spoke = |r: &Value| {
                    let all = r["setup"].as_array().map_or(&[][..], Vec::as_slice);
                    r["exit"] != 3 && all.iter().any(|s| s[5] != "hint")
                };
                let warned = count(&spoke);
                right = [right[0] + refused, right[1] + warned, right[2] + own.len()];
                text += &format!(
                    "| {} | {tool} | {} | {refused} | {warned} | | | | |\n",
                    cell.name,
                    own.len()
                );
            } else {
                let [named, shown, misnamed, silent] =
                    ["named", "told", "misnamed", "silent"].map(|a| count(&|r| r["answer"] == a));
                wrong[0] += named;
                wrong[1] += shown;
                wrong[2] += misnamed;
                wrong[3] += own.len();
                text += &format!(
                    "| {} | {tool} | {} | {refused} | | {named} | {shown} | {misnamed} | {silent} |\n",
                    cell.name,
                    own.len()
                );
            }
        }
        let said = |hits: usize, of: usize| {
            let (low, high) = Share::of(hits, of).interval(LIMITS.confidence);
            format!("{hits} of {of} ({:.1}..{:.1} %)", 100.0 * low, 100.0 * high)
        };
        heads.push(format!(
            "- {tool}: right files refused {}, warned {} (aim: none, and below {:.0} %); mistakes named {} (aim {:.0} %), as an \
             estimate or as undecidable {}, misnamed {} (aim: below {:.0} %).",
            said(right[0], right[2]),
            said(right[1], right[2]),
            100.0 * LIMITS.warned_on_right,
            said(wrong[0], wrong[3]),
            100.0 * LIMITS.mistakes_named,
            said(wrong[1], wrong[3]),
            said(wrong[2], wrong[3]),
            100.0 * LIMITS.misnamed,
        ));
    }
    format!("{}\n\n{text}", heads.join("\n"))
}
