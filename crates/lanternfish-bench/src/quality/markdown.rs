//! The report as a page of Markdown.

use std::fmt::Write;

use super::report::{COLUMNS, Report, cells, truth_cells, truth_line};

pub fn to_markdown(report: &Report) -> String {
    let mut page = String::new();
    // Writing to a String cannot fail.
    let mut line = |text: &str| writeln!(page, "{text}").expect("String");
    line("# Quality of every technique\n");
    for paragraph in report.introduction() {
        line(&format!("{paragraph}\n"));
    }
    for shot in &report.shots {
        line(&format!("## {}\n\n{}\n", shot.name, shot.line()));
        for truth in &shot.truths {
            line(&format!("- {}", truth_line(truth)));
        }
        line(&format!("\n| technique | truth | {} |", COLUMNS.join(" | ")));
        line(&format!("|---|---|{}", "---:|".repeat(COLUMNS.len())));
        for row in &shot.rows {
            match cells(shot, row) {
                Ok(cells) => line(&format!("| {} | {} | {} |", row.name, row.truth, cells.join(" | "))),
                Err(reason) => {
                    line(&format!("| {} | {} | {reason}{}", row.name, row.truth, " |".repeat(COLUMNS.len())));
                }
            }
        }
        for truth in &shot.truths {
            line(&format!("| *noise* | {} | {} |", truth.name, truth_cells(truth).join(" | ")));
        }
        line("");
    }
    if !report.left_out.is_empty() {
        line("## Left out\n");
        for shot in &report.left_out {
            line(&format!("- {}: {}", shot.shot, shot.reason));
        }
    }
    page.trim_end().to_owned() + "\n"
}
