//! Replaces `device.rs` in a program built without the feature `gpu`: no device can be opened.

use std::convert::Infallible;

use super::error::GpuError;
use super::packed::{Aim, Corners, Node, Spot};

pub(super) struct Device(Infallible);

pub(super) struct Tree(Infallible);

pub(super) struct Table(Infallible);

pub(super) struct Flight(Infallible);

impl Device {
    pub fn open(_: u64) -> Result<Device, GpuError> {
        Err(GpuError::NotBuilt)
    }

    pub fn adapter(&self) -> &str {
        match self.0 {}
    }

    pub fn rays_at_once(&self, _: u64) -> usize {
        match self.0 {}
    }

    pub fn spots_at_once(&self, _: u64, _: u64) -> usize {
        match self.0 {}
    }

    pub fn hold(&self, _: &[Node], _: &[Corners]) -> Result<Tree, GpuError> {
        match self.0 {}
    }

    pub fn table(
        &self,
        _: &[[u32; 2]],
        _: &[[f32; 2]],
        _: &[[u32; 2]],
        _: &[[u32; 4]],
    ) -> Result<Table, GpuError> {
        match self.0 {}
    }

    pub fn launch(&self, tree: &Tree, _: &[Aim]) -> Result<Flight, GpuError> {
        match tree.0 {}
    }

    pub fn launch_echoes(
        &self,
        _: &Tree,
        table: &Table,
        _: &[Spot],
        _: u64,
    ) -> Result<Flight, GpuError> {
        match table.0 {}
    }

    pub fn land(&self, flight: Flight) -> Result<Vec<u32>, GpuError> {
        match flight.0 {}
    }
}
