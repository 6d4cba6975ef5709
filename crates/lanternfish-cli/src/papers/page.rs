//! The sheet as a page: images, errors, times of every pass, and what each paper sets.

use std::fmt::Write as _;

use lanternfish_scene::Named as _;

use super::Entry;
use crate::plot::escaped;

const STYLE: &str = "body{font:14px sans-serif;margin:1em;background:#181818;color:#e6e6e6}figure{display:inline-block;margin:0 1em 1em 0;\
                     vertical-align:top}img{display:block;max-width:100%}td,th{text-align:left;padding:0 1em 0 0}\
                     td.n{text-align:right}";

pub fn html(entries: &[Entry], title: &str, command: &str) -> String {
    let mut text = format!(
        "<!doctype html><meta charset=\"utf-8\"><title>Five papers</title><style>{STYLE}</style>\n<h1>Five papers, all \
         at once, and the path tracer</h1>\n<p>{}</p>\n<pre>{}</pre>\n",
        escaped(title),
        escaped(command)
    );
    // Writing to a String cannot fail.
    for entry in entries {
        let lines: Vec<_> = entry.lines.iter().map(|line| escaped(line)).collect();
        let (file, name) = (entry.file(), entry.name());
        let about = entry.paper.map_or("the ground truth: every bounce", |paper| paper.help());
        let _ = writeln!(
            text,
            "<figure><img src=\"{file}\" alt=\"{name}\"><figcaption><b>{name}</b>: {}<br>{}</figcaption></figure>",
            escaped(about),
            lines.join("<br>")
        );
    }
    for entry in entries {
        let Some(paper) = entry.paper else { continue };
        let _ = writeln!(text, "<h2>{paper}</h2>\n<table><tr><th>setting<th>value<th>why");
        for row in paper.rows() {
            let _ = writeln!(text, "<tr><td>{}<td>{}<td>{}", row.name, row.value, escaped(row.source));
        }
        text += "</table>\n<table><tr><th>pass<th>ms\n";
        for (name, ms) in &entry.passes {
            let _ = writeln!(text, "<tr><td>{name}<td class=\"n\">{ms}");
        }
        text += "</table>\n";
    }
    text
}
