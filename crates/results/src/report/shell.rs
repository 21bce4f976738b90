//! The page around the content: head, navigation, style, scripts, and the library of the 3D view.

use std::fmt::Write as _;
use std::io::Write as _;

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use flate2::Compression;
use flate2::write::GzEncoder;
use serde_json::Value;

use super::html::{escape, json_in_script, section};

const STYLE: &str = include_str!("page.css");
const PAGE: &str = include_str!("page.js");
const CHARTS: &str = include_str!("charts.js");
const SCENE: &str = include_str!("scene.js");
/// The 3D library; `three/README.md` describes its version and build.
const THREE: &[u8] = include_bytes!("three/three.min.js.gz");

/// The content security policy: whatever a case file holds, the page loads nothing from the network.
const POLICY: &str = "default-src 'none'; style-src 'unsafe-inline'; script-src 'unsafe-inline'; img-src data: blob:; base-uri 'none'; form-action 'none'";

/// Sets the theme before anything is drawn, so that the page does not flash in the other one.
const THEME: &str = "try{var t=localStorage.getItem('elastocap-theme');if(t==='light'||t==='dark')document.documentElement.dataset.theme=t}catch(e){}";

/// A part of the page's scripts.
pub(super) enum Part<'a> {
    /// Charts that can be read by pointer and keyboard.
    Charts,
    /// The 3D view, with the numbers of its meshes.
    Scene(&'a [u8]),
}

/// A page under construction.
pub(super) struct Page {
    title: String,
    /// The HTML below the title.
    lead: String,
    /// The `id` and the heading of each section.
    contents: Vec<(String, String)>,
    /// The HTML of the sections.
    body: String,
}

impl Page {
    pub(super) fn new(title: &str) -> Self {
        Self { title: title.to_owned(), lead: String::new(), contents: Vec::new(), body: String::new() }
    }

    /// Sets the HTML below the title.
    pub(super) fn lead(&mut self, lead: String) {
        self.lead = lead;
    }

    /// Adds a section; `id` is a plain word, `body` HTML.
    pub(super) fn section(&mut self, id: &str, heading: &str, body: &str) {
        self.contents.push((id.to_owned(), heading.to_owned()));
        self.body.push_str(&section(id, heading, body));
    }

    /// The page as HTML, with the data that its scripts draw.
    pub(super) fn finish(self, data: &Value, parts: &[Part<'_>]) -> String {
        let title = escape(&self.title);
        let mut out = String::with_capacity(self.body.len() + (1 << 18));
        let _ = writeln!(
            out,
            "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
             <meta http-equiv=\"Content-Security-Policy\" content=\"{POLICY}\">\n\
             <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
             <meta name=\"generator\" content=\"elastocap {}\">\n<title>{title}</title>\n\
             <style>\n{STYLE}</style>\n<script>{THEME}</script>\n</head>\n<body>\n\
             <a class=\"skip\" href=\"#main\">Skip to the answer</a>\n\
             <header class=\"top\"><span>elastocap report</span>\
             <button type=\"button\" id=\"theme\" hidden>Dark</button></header>\n<div class=\"layout\">",
            env!("CARGO_PKG_VERSION")
        );
        out.push_str("<nav aria-label=\"Contents\"><ul>\n<li><a href=\"#main\">Answer</a></li>\n");
        for (id, heading) in &self.contents {
            let _ = writeln!(out, "<li><a href=\"#{id}\">{}</a></li>", escape(heading));
        }
        let _ = write!(
            out,
            "</ul></nav>\n<main id=\"main\" tabindex=\"-1\">\n<h1>{title}</h1>\n{}\
             <noscript><p class=\"note\">Without JavaScript this page shows no charts and no 3D view; its tables hold all numbers.</p></noscript>\n{}",
            self.lead, self.body
        );
        let _ = writeln!(
            out,
            "</main>\n</div>\n<footer>elastocap {}. This page is one file and loads nothing.</footer>\n\
             <script type=\"application/json\" id=\"data\">{}</script>",
            env!("CARGO_PKG_VERSION"),
            json_in_script(data)
        );
        let mut code = vec![PAGE];
        for part in parts {
            match part {
                Part::Charts => code.push(CHARTS),
                Part::Scene(bytes) => {
                    let meshes = if bytes.is_empty() { String::new() } else { packed(bytes) };
                    let _ = writeln!(out, "<script type=\"text/plain\" id=\"meshes\">{meshes}</script>");
                    out.push_str("<script type=\"text/plain\" id=\"three\">");
                    STANDARD.encode_string(THREE, &mut out);
                    out.push_str("</script>\n");
                    code.push(SCENE);
                }
            }
        }
        for code in code {
            let _ = writeln!(out, "<script>\n{code}</script>");
        }
        out.push_str("</body>\n</html>\n");
        out
    }
}

/// Bytes compressed by gzip, in base64: the page's script unpacks them.
pub(super) fn packed(bytes: &[u8]) -> String {
    let mut encoder = GzEncoder::new(Vec::new(), Compression::new(4));
    // Writing to memory does not fail.
    let compressed = encoder.write_all(bytes).and_then(|()| encoder.finish()).unwrap_or_default();
    STANDARD.encode(compressed)
}
