//! A plugin called with columns of several strides.
#![expect(unsafe_code, reason = "the part of an engine is to call C functions")]

use std::ptr;

use rumple_plugin_abi::{Batch, Column, ColumnMut, NO_POINT, Report, Status};
use rumple_plugin_sdk::prelude::*;

parameters! {
    /// dc/dt = k v c - c, dv/dt = sin(c).
    pub struct Law {
        k: 2.0, "1", "coupling";
    }
}

impl Model for Law {
    const ABOUT: About = about!("org.rumple.test.law", "Two species");
    const SPECIES: &'static [Species] =
        &[Species::new("c", "1", "one"), Species::new("v", "1", "other")];
    const SIGNALS: &'static [Signal] = &[Signal::TIME.typical(1.0)];

    fn rates<S: Scalar>(&self, at: &Point<'_, S>, rate: &mut [S]) -> Result<(), Failure> {
        let (c, v, t) = (at.species[0], at.species[1], at.signals[0]);
        rate[0] = c * v * self.k - c + t;
        rate[1] = c.sin();
        Ok(())
    }
}

export_plugin!(Law);

const COUNT: usize = 700;

fn value(k: usize) -> f64 {
    f64::from(u16::try_from(k).unwrap_or(u16::MAX)) / 700.0
}

/// Rates and partials at all points; `stride` numbers lie between values of successive points.
fn evaluate(stride: usize) -> Vec<f64> {
    let table = RUMPLE_PLUGIN_ENTRY.table();
    let mut report = Report {
        size: size_of::<Report>(),
        message: ptr::null_mut(),
        capacity: 0,
        length: 0,
        point: NO_POINT,
        factor: 0.5,
    };
    let mut instance = ptr::null_mut();
    let spread = |f: &dyn Fn(usize) -> f64| -> Vec<f64> {
        (0..COUNT * stride).map(|k| f(k / stride)).collect()
    };
    let (c, v, t) = (spread(&value), spread(&|k| 1.0 - value(k)), 0.25);
    let column = |data: &Vec<f64>| Column { data: data.as_ptr(), stride };
    let (species, signals) = ([column(&c), column(&v)], [Column { data: &raw const t, stride: 0 }]);
    let batch = Batch {
        size: size_of::<Batch>(),
        count: COUNT,
        species: species.as_ptr(),
        species_count: 2,
        signals: signals.as_ptr(),
        signal_count: 1,
        parameters: ptr::null(),
        parameter_count: 0,
    };
    let mut room = vec![f64::NAN; 8 * COUNT * stride];
    let columns: Vec<ColumnMut> = room
        .chunks_mut(COUNT * stride)
        .map(|column| ColumnMut { data: column.as_mut_ptr(), stride })
        .collect();
    // SAFETY: the arguments are as the boundary promises; the instance is used before it is freed.
    unsafe {
        let (create, partials) = (table.create.unwrap(), table.rate_partials.unwrap());
        assert_eq!(create([3.0].as_ptr(), 1, &raw mut instance, &raw mut report), Status::OK);
        let (values, slopes) = (columns.as_ptr(), columns[2..].as_ptr());
        let status = partials(instance, &raw const batch, values, slopes, &raw mut report);
        assert_eq!(status, Status::OK);
        table.destroy.unwrap()(instance);
    }
    // Between the points nothing is written.
    for (k, number) in room.iter().enumerate().filter(|(k, _)| k % stride > 0) {
        assert!(number.is_nan(), "{k}");
    }
    room.into_iter().step_by(stride).collect()
}

#[test]
fn values_and_derivatives_are_those_of_the_law() {
    let packed = evaluate(1);
    let (c, v) = (value(70), 1.0 - value(70));
    let expected =
        [3.0 * c * v - c + 0.25, c.sin(), 3.0 * v - 1.0, 3.0 * c, 1.0, c.cos(), 0.0, 0.0];
    for (column, expected) in expected.into_iter().enumerate() {
        let found = packed[column * COUNT + 70];
        assert!((found - expected).abs() < 1e-15, "{column}: {found} {expected}");
    }
}

#[test]
fn columns_with_other_strides_give_the_same() {
    let packed = evaluate(1);
    for stride in [2, 3] {
        assert_eq!(packed, evaluate(stride));
    }
}
