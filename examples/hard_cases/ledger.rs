//! Columns of a ledger by the beginning of their names.

use std::path::Path;

use super::Outcome;

/// A ledger.
#[derive(Debug, Default)]
pub struct Ledger {
    names: Vec<String>,
    rows: Vec<Vec<f64>>,
}

impl Ledger {
    /// That of a result directory; an empty one if it has none.
    ///
    /// # Errors
    /// An entry that is not a number.
    pub fn of(directory: &Path) -> Outcome<Self> {
        let Ok(text) = std::fs::read_to_string(directory.join("ledger.csv")) else {
            return Ok(Self::default());
        };
        let mut lines = text.lines();
        let names = lines.next().unwrap_or_default().split(',').map(str::to_owned).collect();
        let rows = lines.map(|line| line.split(',').map(str::parse).collect::<Result<_, _>>());
        Ok(Self { names, rows: rows.collect::<Result<_, _>>()? })
    }

    /// The column whose name is this, units aside; of `a + b` the sum of two.
    ///
    /// # Errors
    /// If there is none.
    pub fn column(&self, name: &str) -> Outcome<Vec<f64>> {
        if let Some((one, others)) = name.split_once(" + ") {
            let (one, others) = (self.column(one)?, self.column(others)?);
            return Ok(one.iter().zip(others).map(|(a, b)| a + b).collect());
        }
        let is = |title: &String| title == name || title.starts_with(&format!("{name} ["));
        let column = self.names.iter().position(is);
        let column = column.ok_or_else(|| format!("the ledger has no column `{name}`"))?;
        Ok(self.rows.iter().map(|row| row[column]).collect())
    }

    /// Its last value.
    ///
    /// # Errors
    /// The column does not exist, or the ledger has no row.
    pub fn last(&self, name: &str) -> Outcome<f64> {
        Ok(*self.column(name)?.last().ok_or("the ledger has no rows")?)
    }

    /// How many rows there are.
    pub fn len(&self) -> usize {
        self.rows.len()
    }

    /// The first column that has a value that is not finite.
    pub fn not_finite(&self) -> Option<&str> {
        let bad = |row: &Vec<f64>| row.iter().position(|value| !value.is_finite());
        self.rows.iter().find_map(bad).map(|column| self.names[column].as_str())
    }
}
