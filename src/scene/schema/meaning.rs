//! What keys mean: the rows of the reference's tables.

/// Pages of the reference with the tables of a scene that they describe.
const PAGES: [(&str, &[&str]); 6] = [
    (include_str!("../../../docs/book/reference/sheet.md"), &["sheet", "material"]),
    (include_str!("../../../docs/book/reference/effects.md"), &["effect"]),
    (include_str!("../../../docs/book/reference/kinetics.md"), &["kinetics"]),
    (include_str!("../../../docs/book/reference/time.md"), &["time"]),
    (
        include_str!("../../../docs/book/reference/solvers.md"),
        &["equilibrium", "stability", "invariants"],
    ),
    (include_str!("../../../docs/book/reference/output.md"), &["output", "checkpoint"]),
];

/// Where the meaning of a value and of those inside is looked up.
#[derive(Clone)]
pub(super) struct Meanings {
    page: &'static str,
    heading: String,
    path: Vec<String>,
}

impl Meanings {
    /// Of a table of the scene.
    pub(super) fn of_table(table: &str) -> Self {
        let page = PAGES.iter().find(|(_, tables)| tables.contains(&table));
        let heading = format!("`[{table}]`");
        Self { page: page.map_or("", |(page, _)| page), heading, path: Vec::new() }
    }

    /// Of a table of a kind: effects have headings of their own.
    pub(super) fn of_kind(&self, kind: &str) -> Self {
        let mut letters = kind.chars();
        let first = letters.next().map(|first| first.to_ascii_uppercase());
        let heading: String = first.into_iter().chain(letters).collect();
        let own = self.page.lines().any(|line| line.trim_start_matches('#').trim() == heading);
        let heading = if own { heading } else { self.heading.clone() };
        Self { heading, ..self.clone() }
    }

    /// Of the value at a key.
    pub(super) fn of_key(&self, key: &str) -> Self {
        let mut below = self.clone();
        below.path.push(key.to_owned());
        below
    }

    /// The row of the value itself: its meaning, with unit and default.
    pub(super) fn own_text(&self) -> Option<String> {
        let key = self.path.last()?;
        let parent = self.path.iter().rev().nth(1);
        let dotted =
            parent.map_or_else(|| format!("`{key}`"), |parent| format!("`{parent}.{key}`"));
        let rows: Vec<_> = self.rows().collect();
        let at = |code: &str| rows.iter().position(|(_, row)| row[0].contains(code));
        let bare = format!("`{key}`");
        let first = at(&dotted).or_else(|| at(&bare).filter(|_| parent.is_none()))?;
        let cell = |(header, row): &(Vec<String>, Vec<String>), name: &str| {
            let column = header.iter().position(|title| title == name)?;
            row.get(column).map(|cell| plain(cell)).filter(|cell| !cell.is_empty())
        };
        // Further choices have rows of their own, without a key.
        let more = rows[first + 1..].iter().take_while(|(_, row)| row[0].is_empty());
        let all: Vec<_> = std::iter::once(&rows[first]).chain(more).collect();
        let meaning = |row| {
            let meaning = cell(row, "meaning").or_else(|| row.1.last().map(|cell| plain(cell)))?;
            let choice = cell(row, "choices").or_else(|| cell(row, "range, choices"));
            match choice.filter(|_| all.len() > 1) {
                Some(choice) => Some(format!("{choice}: {meaning}")),
                None => Some(meaning),
            }
        };
        let mut text = all.iter().copied().filter_map(meaning).collect::<Vec<_>>().join("; ");
        for name in ["unit", "default"] {
            if let Some(value) = cell(all[0], name) {
                text.push_str(&format!("; {name}: {value}"));
            }
        }
        Some(text)
    }

    /// The rows below the heading, each with the header of its table.
    fn rows(&self) -> impl Iterator<Item = (Vec<String>, Vec<String>)> {
        let (mut inside, mut header) = (false, Vec::new());
        self.page.lines().filter_map(move |line| {
            if line.starts_with('#') {
                inside = line.trim_start_matches('#').trim() == self.heading;
            }
            if !inside || !line.starts_with('|') {
                header.clear();
                return None;
            }
            let cells: Vec<String> = cells(line);
            if header.is_empty() {
                header = cells;
                return None;
            }
            (!line.starts_with("| ---")).then(|| (header.clone(), cells))
        })
    }
}

fn cells(line: &str) -> Vec<String> {
    let line = line.trim_matches('|').replace("\\|", "/");
    line.split('|').map(|cell| cell.trim().to_owned()).collect()
}

/// Text without links and marks.
fn plain(cell: &str) -> String {
    let mut text = String::new();
    let mut rest = cell;
    while let Some((before, link)) = rest.split_once('[') {
        let Some((words, target)) = link.split_once("](") else { break };
        let Some((_, after)) = target.split_once(')') else { break };
        text.push_str(before);
        text.push_str(words);
        rest = after;
    }
    text.push_str(rest);
    text.replace('`', "")
}
