//! The report as a page to look at: the tables, and every picture beside its truth and its FLIP map. No scripts.

use std::fmt::Write;

use super::{
    measure::Row,
    report::{COLUMNS, Report, ShotReport, cells, truth_cells, truth_line},
};

const STYLE: &str = "\
body { font: 15px/1.45 system-ui, sans-serif; margin: 2em; background: #181a1c; color: #d8dadc }
p, li { max-width: 60em }
table { border-collapse: collapse }
th, td { padding: .2em .8em; text-align: right; border-bottom: 1px solid #34383c; font-variant-numeric: tabular-nums }
th:nth-child(-n+2), td:nth-child(-n+2) { text-align: left }
tr.noise { color: #8e959c; font-style: italic }
td.marked { color: #ffb454 }
.pictures { display: flex; flex-wrap: wrap; gap: 1em; margin: 1em 0 2.5em }
figure { margin: 0 }
img { display: inline-block; width: 288px; image-rendering: pixelated; vertical-align: top }
figcaption { font-size: 13px; color: #a4abb2 }";

pub fn to_html(report: &Report) -> String {
    let mut page = format!(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<meta charset=\"utf-8\">\n<title>Quality of every technique</title>\n\
         <style>\n{STYLE}\n</style>\n<h1>Quality of every technique</h1>\n"
    );
    // Writing to a String cannot fail.
    let mut line = |text: &str| writeln!(page, "{text}").expect("String");
    for paragraph in report.introduction() {
        line(&format!("<p>{}</p>", escaped(&paragraph)));
    }
    for shot in &report.shots {
        line(&format!("<h2>{}</h2>\n<p>{}</p>\n<ul>", escaped(shot.name), escaped(&shot.line())));
        for truth in &shot.truths {
            line(&format!("<li>{}</li>", escaped(&truth_line(truth))));
        }
        line("</ul>");
        line(&table(shot));
        line(&pictures(shot));
    }
    if !report.left_out.is_empty() {
        line("<h2>Left out</h2>\n<ul>");
        for shot in &report.left_out {
            line(&format!("<li>{}: {}</li>", shot.shot, escaped(&shot.reason)));
        }
        line("</ul>");
    }
    page + "</html>\n"
}

fn table(shot: &ShotReport) -> String {
    let heads: String = COLUMNS.iter().map(|name| format!("<th>{name}")).collect();
    let mut text = format!("<table>\n<tr><th>technique<th>truth{heads}\n");
    let mut line = |class: &str, name: &str, truth: &str, cells: &str| {
        let (name, truth) = (escaped(name), escaped(truth));
        writeln!(text, "<tr{class}><td>{name}<td>{truth}{cells}").expect("String");
    };
    let cell = |cell: &String| {
        let class = if cell.ends_with('*') { " class=\"marked\"" } else { "" };
        format!("<td{class}>{}", escaped(cell))
    };
    for row in &shot.rows {
        let cells = match cells(shot, row) {
            Ok(cells) => cells.iter().map(cell).collect(),
            Err(reason) => format!("<td colspan=\"{}\" style=\"text-align: left\">{}", COLUMNS.len(), escaped(reason)),
        };
        line("", &row.name, row.truth, &cells);
    }
    for truth in &shot.truths {
        let cells: String = truth_cells(truth).iter().map(cell).collect();
        line(" class=\"noise\"", "noise", truth.name, &cells);
    }
    text + "</table>"
}

/// Truths, then every picture that is not one shown before, with its map.
fn pictures(shot: &ShotReport) -> String {
    let mut text = "<div class=\"pictures\">\n".to_owned();
    let mut figure = |images: &[&str], caption: &str| {
        let images: String =
            images.iter().map(|image| format!("<img src=\"{0}\" alt=\"{0}\">", escaped(image))).collect();
        writeln!(text, "<figure>{images}<figcaption>{}</figcaption></figure>", escaped(caption)).expect("String");
    };
    for truth in &shot.truths {
        figure(&[&truth.picture], &format!("truth: {}", truth.name));
    }
    let mut shown: Vec<&str> = Vec::new();
    for row in &shot.rows {
        let Some(figures) = row.figures.as_ref().filter(|figures| !shown.contains(&figures.picture.as_str())) else {
            continue;
        };
        shown.push(&figures.picture);
        let names: Vec<&str> =
            shot.rows.iter().filter(|other| shows(other, &figures.picture)).map(|r| &*r.name).collect();
        let caption = format!("{}; FLIP {:.4} against {}", names.join(" = "), figures.errors.flip, row.truth);
        figure(&[&figures.picture, &figures.map], &caption);
    }
    text + "</div>"
}

fn shows(row: &Row, picture: &str) -> bool {
    row.figures.as_ref().is_some_and(|figures| figures.picture == picture)
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn text_is_text() {
        assert_eq!(escaped("a < \"b\" & c"), "a &lt; &quot;b&quot; &amp; c");
    }
}
