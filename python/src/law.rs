//! Laws written in Python, evaluated on whole batches of points.

use std::sync::{Arc, OnceLock};

use numpy::PyArray1;
use pyo3::exceptions::{PyAttributeError, PyKeyError, PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::{IntoPyDict, PyDict, PyString, PyTuple};
use rumple::kinetics::{
    self as engine, Capabilities, Column, Descriptor, Feedback, HostLaw, Kinetics, KineticsError,
    Location, Outcome, Parameter, Quantity, Signal, SignalRead, differences,
};
use rumple::output::provenance::fingerprint;

use crate::convert;
use crate::engine::Slot;

/// A law: a function that gives the rates of species from columns of species, signals and parameters.
#[pyclass(module = "rumple", frozen)]
pub(crate) struct Law {
    descriptor: Arc<Descriptor>,
    functions: Arc<Functions>,
    /// Hash of descriptor and code.
    digest: String,
    /// What it was made from, for pickle.
    made_from: (Py<PyTuple>, Py<PyDict>),
}

/// The functions of a law.
#[derive(Debug)]
struct Functions {
    rates: Py<PyAny>,
    rate_partials: Option<Py<PyAny>>,
    length_factor: Option<Py<PyAny>>,
    length_factor_across: Option<Py<PyAny>>,
    curvature: Option<Py<PyAny>>,
}

impl Functions {
    fn feedback(&self, which: Feedback) -> Option<&Py<PyAny>> {
        match which {
            Feedback::LengthFactor => self.length_factor.as_ref(),
            Feedback::Curvature => self.curvature.as_ref(),
            Feedback::FactorAcross => self.length_factor_across.as_ref(),
        }
    }
}

/// What a law reads at a batch of points: columns and numbers, by name.
#[pyclass(module = "rumple", frozen)]
pub(crate) struct Batch(Py<PyDict>);

#[pymethods]
impl Batch {
    fn __getitem__<'py>(&self, py: Python<'py>, name: &str) -> PyResult<Bound<'py, PyAny>> {
        let found = self.0.bind(py).get_item(name)?;
        found.ok_or_else(|| PyKeyError::new_err(name.to_owned()))
    }

    fn __getattr__<'py>(&self, py: Python<'py>, name: &str) -> PyResult<Bound<'py, PyAny>> {
        let found = self.0.bind(py).get_item(name)?;
        let names = || Ok::<_, PyErr>(self.0.bind(py).keys().repr()?.to_string());
        match found {
            Some(found) => Ok(found),
            None => {
                let text = format!("the law reads no {name:?}; it reads {}", names()?);
                Err(PyAttributeError::new_err(text))
            }
        }
    }

    /// Names of the columns and numbers.
    fn keys<'py>(&self, py: Python<'py>) -> Bound<'py, PyAny> {
        self.0.bind(py).keys().into_any()
    }
}

#[pymethods]
impl Law {
    /// `species` and `signals` are names, or a dict of names and typical magnitudes (species also: dicts with
    /// `typical`, `lower`, `upper`, `unit`); `parameters` are names and values. `rate_partials` gives the derivatives of the
    /// rates by pairs of a species and an input, or is "jax".
    #[new]
    #[pyo3(signature = (rates, species, *, signals = None, parameters = None, rate_partials = None,
        length_factor = None, length_factor_across = None, curvature = None, location = "vertex", name = None))]
    #[allow(clippy::too_many_arguments)]
    fn new(
        py: Python<'_>,
        rates: Py<PyAny>,
        species: &Bound<'_, PyAny>,
        signals: Option<&Bound<'_, PyAny>>,
        parameters: Option<&Bound<'_, PyDict>>,
        rate_partials: Option<Py<PyAny>>,
        length_factor: Option<Py<PyAny>>,
        length_factor_across: Option<Py<PyAny>>,
        curvature: Option<Py<PyAny>>,
        location: &str,
        name: Option<String>,
    ) -> PyResult<Self> {
        let keywords = [
            ("signals", signals.cloned()),
            ("parameters", parameters.map(|parameters| parameters.as_any().clone())),
            ("rate_partials", rate_partials.as_ref().map(|given| given.bind(py).clone())),
            ("length_factor", length_factor.as_ref().map(|function| function.bind(py).clone())),
            ("length_factor_across", length_factor_across.as_ref().map(|f| f.bind(py).clone())),
            ("curvature", curvature.as_ref().map(|function| function.bind(py).clone())),
            ("location", Some(PyString::new(py, location).into_any())),
            ("name", name.as_ref().map(|name| PyString::new(py, name).into_any())),
        ];
        let positional = (rates.bind(py), species).into_pyobject(py)?.unbind();
        let made_from = (positional, keywords.into_py_dict(py)?.unbind());
        let location = location_of(location)?;
        let called = || rates.bind(py).getattr("__name__")?.extract::<String>();
        let name = name.or_else(|| called().ok()).unwrap_or_else(|| "law".to_owned());
        let parameters = parameters.into_iter().flat_map(|parameters| parameters.iter());
        let parameters: Vec<(String, f64)> = parameters
            .map(|(name, value)| Ok((name.extract()?, value.extract()?)))
            .collect::<PyResult<_>>()?;
        let descriptor = Descriptor {
            id: format!("python.{name}"),
            name,
            version: String::new(),
            author: String::new(),
            licence: String::new(),
            doc: String::new(),
            species: named(species)?
                .into_iter()
                .map(|(name, about)| species_of(name, about, location))
                .collect::<PyResult<_>>()?,
            parameters: parameters
                .iter()
                .map(|(name, value)| Parameter::named(name, *value))
                .collect(),
            signals: signals.map_or(Ok(Vec::new()), signals_of)?,
            observables: Vec::new(),
            observed: Vec::new(),
            capabilities: Capabilities {
                rate_partials: rate_partials.is_some(),
                length_factor: length_factor.is_some(),
                length_factor_across: length_factor_across.is_some(),
                curvature: curvature.is_some(),
                parameter_fields: true,
                ..Capabilities::default()
            },
        };
        if descriptor.species.is_empty() {
            return Err(PyValueError::new_err("a law has at least one species"));
        }
        let given = [Some(&rates), rate_partials.as_ref(), length_factor.as_ref()];
        let given = given.into_iter().chain([length_factor_across.as_ref(), curvature.as_ref()]);
        let given: Vec<&Py<PyAny>> = given.flatten().collect();
        let code = py.import("rumple._law")?.call_method1("code", (given,))?;
        let digest = fingerprint(&format!("{descriptor:?}\n{}", code.extract::<String>()?));
        let (rates, rate_partials) = match rate_partials {
            Some(given) if given.bind(py).is_instance_of::<PyString>() => {
                let inputs: Vec<&str> = descriptor.input_names().collect();
                let made = py.import("rumple._law")?.getattr("differentiated")?;
                let (rates, partials) = made.call1((given, rates, inputs))?.extract()?;
                (rates, Some(partials))
            }
            given => (rates, given),
        };
        let functions =
            Functions { rates, rate_partials, length_factor, length_factor_across, curvature };
        let functions = Arc::new(functions);
        Ok(Self { descriptor: Arc::new(descriptor), functions, digest, made_from })
    }

    fn __getnewargs_ex__(&self, py: Python<'_>) -> (Py<PyTuple>, Py<PyDict>) {
        (self.made_from.0.clone_ref(py), self.made_from.1.clone_ref(py))
    }

    /// The name that scenes call it by.
    #[getter]
    fn name(&self) -> &str {
        &self.descriptor.name
    }

    /// Names of the species.
    #[getter]
    fn species(&self) -> Vec<&str> {
        self.descriptor.species.iter().map(|species| species.name.as_str()).collect()
    }

    fn __repr__(&self) -> String {
        format!("<rumple.Law {}>", self.descriptor.name)
    }
}

fn location_of(name: &str) -> PyResult<Location> {
    match name {
        "vertex" => Ok(Location::Vertex),
        "face" => Ok(Location::Face),
        other => {
            let text = format!("location is {other:?}, expected \"vertex\" or \"face\"");
            Err(PyValueError::new_err(text))
        }
    }
}

/// Names, each with what a dict says about it.
fn named<'py>(all: &Bound<'py, PyAny>) -> PyResult<Vec<(String, Option<Bound<'py, PyAny>>)>> {
    if let Ok(table) = all.cast::<PyDict>() {
        return table.iter().map(|(name, about)| Ok((name.extract()?, Some(about)))).collect();
    }
    if let Ok(one) = all.extract::<String>() {
        return Ok(vec![(one, None)]);
    }
    all.try_iter()?.map(|name| Ok((name?.extract()?, None))).collect()
}

fn positive(name: &str, typical: f64) -> PyResult<f64> {
    match typical > 0.0 && typical.is_finite() {
        true => Ok(typical),
        false => Err(PyValueError::new_err(format!(
            "the typical magnitude of {name} is {typical}; it must be positive and finite"
        ))),
    }
}

fn species_of(
    name: String,
    about: Option<Bound<'_, PyAny>>,
    location: Location,
) -> PyResult<engine::Species> {
    let mut species = engine::Species { location, ..engine::Species::named(name) };
    let Some(about) = about else { return Ok(species) };
    let Ok(table) = about.cast::<PyDict>() else {
        species.typical = Some(positive(&species.name, about.extract()?)?);
        return Ok(species);
    };
    for (key, value) in table.iter() {
        match key.extract::<String>()?.as_str() {
            "typical" => species.typical = Some(positive(&species.name, value.extract()?)?),
            "lower" => species.lower = value.extract()?,
            "upper" => species.upper = value.extract()?,
            "unit" => species.unit = value.extract()?,
            other => {
                let text =
                    format!("a species has typical, lower, upper and unit, but no {other:?}");
                return Err(PyValueError::new_err(text));
            }
        }
    }
    let (lower, upper) = (species.lower, species.upper);
    if !(lower < upper) {
        let text =
            format!("species {:?}: lower = {lower} is not below upper = {upper}", species.name);
        return Err(PyValueError::new_err(text));
    }
    Ok(species)
}

fn signals_of(signals: &Bound<'_, PyAny>) -> PyResult<Vec<SignalRead>> {
    let read = |(name, typical): (String, Option<Bound<'_, PyAny>>)| {
        let signal: Signal = name.parse().map_err(PyValueError::new_err)?;
        let typical = typical.map_or(Ok(1.0), |typical| typical.extract())?;
        Ok(SignalRead { signal, typical: positive(&name, typical)? })
    };
    named(signals)?.into_iter().map(read).collect()
}

impl Law {
    /// The law for the engine, which leaves exceptions of the functions in `raised`.
    pub(crate) fn host_law(&self, raised: &Slot) -> HostLaw {
        let descriptor = Arc::clone(&self.descriptor);
        let (functions, raised) = (Arc::clone(&self.functions), raised.clone());
        HostLaw::new(Arc::clone(&self.descriptor), self.digest.clone(), move |values| {
            Arc::new(PythonKinetics {
                descriptor: Arc::clone(&descriptor),
                values,
                typical: OnceLock::new(),
                functions: Arc::clone(&functions),
                raised: raised.clone(),
            })
        })
    }
}

/// A law of functions in Python.
#[derive(Debug)]
struct PythonKinetics {
    descriptor: Arc<Descriptor>,
    values: Vec<f64>,
    typical: OnceLock<Vec<f64>>,
    functions: Arc<Functions>,
    raised: Slot,
}

impl Kinetics for PythonKinetics {
    fn descriptor(&self) -> &Descriptor {
        &self.descriptor
    }

    fn parameters(&self) -> &[f64] {
        &self.values
    }

    fn evaluate(
        &self,
        quantity: Quantity,
        batch: &engine::Batch<'_>,
        values: &mut [&mut [f64]],
        partials: &mut [&mut [f64]],
    ) -> Outcome {
        match (quantity, &self.functions.rate_partials) {
            (Quantity::Rates, Some(function)) if !partials.is_empty() => {
                self.rates(batch, values)?;
                self.rate_partials(function, batch, partials)
            }
            _ if !partials.is_empty() => {
                differences::partials(self, quantity, batch, values, partials)
            }
            (Quantity::Rates, _) => self.rates(batch, values),
            (Quantity::Feedback(which), _) => self.feedback(which, batch, values),
            (Quantity::Observables, _) => Ok(None),
        }
    }

    fn set_typical(&self, typical: &[f64]) {
        self.typical.get_or_init(|| typical.to_vec());
    }

    fn typical(&self) -> Option<&[f64]> {
        self.typical.get().map(Vec::as_slice)
    }
}

impl PythonKinetics {
    fn rates(&self, batch: &engine::Batch<'_>, rates: &mut [&mut [f64]]) -> Outcome {
        self.call("rates", |py| {
            let given = self.functions.rates.bind(py).call1((self.inputs(py, batch)?,))?;
            let given = given.cast::<PyDict>().map_err(|_| {
                PyTypeError::new_err("the function of the rates must return a dict by species")
            })?;
            for name in given.keys().iter() {
                let name = name.extract::<String>()?;
                if self.descriptor.species_index(&name).is_none() {
                    let text = format!("rates are returned for {name:?}, which is not a species");
                    return Err(PyKeyError::new_err(text));
                }
            }
            for (species, rate) in self.descriptor.species.iter().zip(rates) {
                let column = given.get_item(&species.name)?.ok_or_else(|| {
                    PyKeyError::new_err(format!("no rate is returned for {:?}", species.name))
                })?;
                write(&column, &format!("the rate of {}", species.name), rate)?;
            }
            Ok(())
        })
    }

    fn rate_partials(
        &self,
        function: &Py<PyAny>,
        batch: &engine::Batch<'_>,
        partials: &mut [&mut [f64]],
    ) -> Outcome {
        partials.iter_mut().for_each(|column| column.fill(0.0));
        self.call("rate_partials", |py| {
            let given = function.bind(py).call1((self.inputs(py, batch)?,))?;
            let given = given.cast::<PyDict>().map_err(|_| {
                PyTypeError::new_err(
                    "rate_partials must return a dict by pairs of a species and an input",
                )
            })?;
            for (pair, column) in given.iter() {
                let (species, input): (String, String) = pair.extract().map_err(|_| {
                    PyKeyError::new_err(format!("{pair} is not a pair of a species and an input"))
                })?;
                let place = self.descriptor.species_index(&species).zip(
                    self.descriptor.input_names().position(|name| name == input),
                );
                let Some((species_index, input_index)) = place else {
                    let inputs: Vec<&str> = self.descriptor.input_names().collect();
                    let text = format!(
                        "a derivative of {species:?} by {input:?} is returned; species and inputs are {inputs:?}"
                    );
                    return Err(PyKeyError::new_err(text));
                };
                let out = &mut *partials[species_index * self.descriptor.inputs() + input_index];
                write(&column, &format!("the derivative of {species} by {input}"), out)?;
            }
            Ok(())
        })
    }

    fn feedback(
        &self,
        which: Feedback,
        batch: &engine::Batch<'_>,
        values: &mut [&mut [f64]],
    ) -> Outcome {
        let Some(function) = self.functions.feedback(which) else {
            Quantity::Feedback(which).write_neutral(values, &mut []);
            return Ok(None);
        };
        self.call(which.name(), |py| {
            let given = function.bind(py).call1((self.inputs(py, batch)?,))?;
            write(&given, which.name(), values[0])
        })
    }

    /// Does `work` with the interpreter; an exception is kept, and ends the call of the engine.
    fn call(&self, call: &'static str, work: impl FnOnce(Python<'_>) -> PyResult<()>) -> Outcome {
        let done = Python::attach(|py| work(py).map_err(|error| (error.to_string(), error)));
        let Err((message, error)) = done else { return Ok(None) };
        self.raised.keep(error);
        let plugin = self.descriptor.name.clone();
        Err(KineticsError::Failed { plugin, call, point: None, message })
    }

    /// The inputs of a batch by name: columns, and numbers where they are uniform.
    fn inputs(&self, py: Python<'_>, batch: &engine::Batch<'_>) -> PyResult<Batch> {
        let inputs = PyDict::new(py);
        let columns = |column: &Column<'_>| match column.contiguous(batch.count) {
            Some(values) => convert::column(py, values),
            None => {
                let all = (0..batch.count).map(|point| column.at(point));
                convert::read_only(&PyArray1::from_iter(py, all))
            }
        };
        for (parameter, value) in self.descriptor.parameters.iter().zip(&self.values) {
            inputs.set_item(&parameter.name, value)?;
        }
        for (parameter, column) in self.descriptor.parameters.iter().zip(batch.parameters) {
            inputs.set_item(&parameter.name, columns(column))?;
        }
        for (name, column) in self.descriptor.input_names().zip(batch.inputs()) {
            inputs.set_item(name, columns(column))?;
        }
        Ok(Batch(inputs.unbind()))
    }
}

/// Writes what a function has returned for `name`: a number, or one a point.
fn write(given: &Bound<'_, PyAny>, name: &str, out: &mut [f64]) -> PyResult<()> {
    out.copy_from_slice(&convert::values(given, name, out.len())?);
    Ok(())
}
