//! The camera on the robot: from a row of an image to a place on the floor.
//!
//! The floor is flat. The camera looks ahead, pitched down, without roll; pixels are square, the optical axis meets
//! the middle of the image, and one radial term bends it (the division model, A. W. Fitzgibbon, *Simultaneous linear
//! estimation of multiple view geometry and lens distortion*, 2001). With half the image's width as the unit of
//! length, a pixel at the distance r from the middle is seen along a ray of slope
//!
//! ```text
//! t (1 + k) r / (1 + k r²),      t = tan(field_of_view / 2),      k = distortion
//! ```
//!
//! away from the axis, so that the field of view holds whatever the distortion is.

pub mod ground;

/// A camera and how it is mounted.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Camera {
    /// Height of the lens above the floor, in metres.
    pub height: f64,
    /// Angle of the optical axis below the horizontal, in degrees.
    pub pitch: f64,
    /// Horizontal field of view, from the left edge to the right edge of the image, in degrees.
    pub field_of_view: f64,
    /// The radial distortion k, without unit: negative for a barrel, positive for a pincushion, 0 for none.
    pub distortion: f64,
}

// Stand-ins, which the camera's own files replace.
impl Camera {
    /// Stand-in: reads no file but asks for one to be there.
    ///
    /// # Errors
    /// If there is none.
    pub fn load(path: &std::path::Path) -> Result<Camera, CameraError> {
        let there = std::fs::metadata(path);
        there.map_err(|error| CameraError(format!("{}: cannot read the camera: {error}", path.display())))?;
        Ok(Camera { height: 0.8, pitch: 20.0, field_of_view: 90.0, distortion: 0.0 })
    }

    /// Stand-in.
    ///
    /// # Errors
    /// None.
    pub fn check(&self, _width: u32, _height: u32) -> Result<(), CameraError> {
        Ok(())
    }
}

/// Stand-in.
#[derive(Debug, thiserror::Error)]
#[error("{0}")]
pub struct CameraError(String);
