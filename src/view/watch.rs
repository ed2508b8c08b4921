//! A page that follows a run in progress: served on the loopback address, and loaded again when the results have changed.

use std::fs;
use std::hash::{DefaultHasher, Hash, Hasher};
use std::path::Path;

use serde_json::json;
use tiny_http::{Header, Response, Server};

use super::{Options, page, runs};
use crate::output::{Claim, ResultDirectory};
use crate::run::{Error, Result};

/// Serves the page of the result directory `root` on `port` of 127.0.0.1, a free one if that is 0, until the program ends;
/// `ready` is given its address first.
///
/// # Errors
/// [`Error::Refused`] for a directory without results, and for a port that cannot be had.
pub fn serve(root: &Path, options: Options, port: u16, ready: impl FnOnce(&str)) -> Result<()> {
    runs::find(root)?;
    let server = Server::http(("127.0.0.1", port))
        .map_err(|error| Error::Refused(format!("port {port}: {error}")))?;
    ready(&format!("http://{}/", server.server_addr()));
    for request in server.incoming_requests() {
        let state = state_of(root);
        let (kind, text) = match request.url() {
            "/" => ("text/html", page_of(root, options, &state)),
            "/state" => ("text/plain", state),
            _ => ("text/plain", String::new()),
        };
        let mut answer = Response::from_string(text);
        if let Ok(header) = Header::from_bytes("Content-Type", format!("{kind}; charset=utf-8")) {
            answer.add_header(header);
        }
        // A browser that has gone needs no answer.
        let _ = request.respond(answer);
    }
    Ok(())
}

/// The page; while a file is being written perhaps none, which is asked for again.
fn page_of(root: &Path, options: Options, state: &str) -> String {
    let page = runs::find(root)
        .and_then(|found| page::render(root, &found, options, Some(json!({ "watch": state }))));
    page.map_or_else(
        |error| {
            let text = error.to_string().replace('&', "&amp;").replace('<', "&lt;");
            format!("<!DOCTYPE html><meta http-equiv=\"refresh\" content=\"2\"><p>{text}")
        },
        |page| page.html,
    )
}

/// A word that is another one when the results have changed.
fn state_of(root: &Path) -> String {
    let mut hasher = DefaultHasher::new();
    let found = runs::find(root).map(|found| found.runs).unwrap_or_default();
    let own = (String::new(), root.to_owned());
    for (_, folder) in found.into_iter().chain([own]) {
        let names =
            [ResultDirectory::LEDGER, ResultDirectory::PVD, ResultDirectory::PLOTS, Claim::STATUS];
        for name in names {
            let about = fs::metadata(folder.join(name)).ok();
            about.map(|about| (about.len(), about.modified().ok())).hash(&mut hasher);
        }
    }
    format!("{:x}", hasher.finish())
}
