//! Position of the sun by location and time.

use glam::Vec3;

/// A location on Earth, and a local date and time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlaceAndHour {
    /// Degrees north of the equator, −90 to 90.
    pub latitude: f64,
    /// Degrees east of Greenwich, −180 to 180.
    pub longitude: f64,
    /// Year of the Gregorian calendar.
    pub year: i32,
    /// 1 to 12.
    pub month: u32,
    /// 1 to 31.
    pub day: u32,
    /// Hours after local midnight.
    pub hour: f64,
    /// UTC offset, h.
    pub ahead_of_utc: f64,
}

/// Position of the sun in the sky, radians, without atmospheric refraction, which raises it by 0.5° at the horizon.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SunPosition {
    /// From north, clockwise: east is π/2. 0 to 2π.
    pub azimuth: f64,
    /// Above the horizon; below 0 at night.
    pub elevation: f64,
}

impl PlaceAndHour {
    /// Days since noon of 1 January 2000, UTC [Meeus1998, ch. 7].
    fn days(&self) -> f64 {
        let (year, month) = if self.month <= 2 { (self.year - 1, self.month + 12) } else { (self.year, self.month) };
        let century = (f64::from(year) / 100.0).floor();
        let leap = 2.0 - century + (century / 4.0).floor();
        let whole_days = (365.25 * (f64::from(year) + 4716.0)).floor() + (30.6001 * (f64::from(month) + 1.0)).floor();
        whole_days + f64::from(self.day) + leap - 1524.5 - 2_451_545.0 + (self.hour - self.ahead_of_utc) / 24.0
    }

    /// The sun's position: apparent position by the low-accuracy method of [Meeus1998, ch. 25], converted to horizontal coordinates
    /// [Meeus1998, ch. 12, ch. 13]. The error is about 0.01° in the 20th and 21st centuries.
    pub fn sun(&self) -> SunPosition {
        let days = self.days();
        let (right_ascension, declination) = equatorial(days / 36_525.0);
        let sidereal = (280.460_618_37 + 360.985_647_366_29 * days).to_radians();
        let hour_angle = sidereal + self.longitude.to_radians() - right_ascension;
        let latitude = self.latitude.to_radians();
        let ((sin_h, cos_h), (sin_d, cos_d)) = (hour_angle.sin_cos(), declination.sin_cos());
        let (sin_l, cos_l) = latitude.sin_cos();
        let elevation = (sin_l * sin_d + cos_l * cos_d * cos_h).clamp(-1.0, 1.0).asin();
        // East and north components of the direction to the sun.
        let (east, north) = (-cos_d * sin_h, sin_d * cos_l - cos_d * cos_h * sin_l);
        SunPosition { azimuth: east.atan2(north).rem_euclid(std::f64::consts::TAU), elevation }
    }
}

impl SunPosition {
    /// Direction of the sunlight, unit vector, world space: north is −z, east +x, up +y.
    pub fn direction(&self) -> Vec3 {
        let (sin, cos) = self.elevation.sin_cos();
        let from = [cos * self.azimuth.sin(), sin, -cos * self.azimuth.cos()];
        -Vec3::from(from.map(|x| x as f32))
    }
}

/// The sun's apparent right ascension and declination, radians, `t` Julian centuries after J2000 [Meeus1998, ch. 25].
fn equatorial(t: f64) -> (f64, f64) {
    let mean_longitude = 280.466_46 + t * (36_000.769_83 + 0.000_303_2 * t);
    let anomaly = (357.529_11 + t * (35_999.050_29 - 0.000_153_7 * t)).to_radians();
    let center = anomaly.sin() * (1.914_602 - t * (0.004_817 + 0.000_014 * t))
        + (2.0 * anomaly).sin() * (0.019_993 - 0.000_101 * t)
        + (3.0 * anomaly).sin() * 0.000_289;
    let node = (125.04 - 1_934.136 * t).to_radians();
    let longitude = (mean_longitude + center - 0.005_69 - 0.004_78 * node.sin()).to_radians();
    let obliquity = 23.439_291_1 - t * (0.013_004_17 + t * (1.64e-7 - 5.04e-7 * t)) + 0.002_56 * node.cos();
    let (sin_o, cos_o) = obliquity.to_radians().sin_cos();
    ((cos_o * longitude.sin()).atan2(longitude.cos()), (sin_o * longitude.sin()).asin())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[track_caller]
    fn near(angle: f64, degrees: f64, tolerance: f64) {
        let apart = (angle.to_degrees() - degrees + 180.0).rem_euclid(360.0) - 180.0;
        assert!(apart.abs() < tolerance, "{}° for {degrees}°", angle.to_degrees());
    }

    #[test]
    fn the_sun_position_matches_published_tables() {
        // [Meeus1998, example 25.a]: 13 October 1992 at 0 h.
        let (right_ascension, declination) = equatorial(-0.072_183_436);
        near(right_ascension, 198.380_83, 1e-4);
        near(declination, -7.785_07, 1e-4);
        // [Reda2004, table A5.1]: Golden, Colorado, without refraction. The table's observer is on the
        // ground (topocentric), not at Earth's centre.
        let golden = PlaceAndHour {
            latitude: 39.742_476,
            longitude: -105.178_6,
            year: 2003,
            month: 10,
            day: 17,
            hour: 12.0 + 30.0 / 60.0 + 30.0 / 3600.0,
            ahead_of_utc: -7.0,
        };
        near(golden.sun().azimuth, 194.340_24, 0.01);
        near(golden.sun().elevation, 39.872_05, 0.01);
    }

    #[test]
    fn it_rises_in_the_east_and_is_high_at_noon() {
        let at = |hour: f64, latitude: f64| {
            let place =
                PlaceAndHour { latitude, longitude: 0.0, year: 2024, month: 3, day: 20, hour, ahead_of_utc: 0.0 };
            place.sun()
        };
        near(at(6.12, 45.0).azimuth, 90.0, 1.0);
        near(at(12.12, 45.0).elevation, 45.0, 0.5);
        near(at(12.12, 45.0).azimuth, 180.0, 1.0);
        near(at(12.12, -45.0).azimuth, 0.0, 1.0);
        assert!(at(0.0, 45.0).elevation < 0.0);
        // Morning light travels west and down.
        let direction = at(8.0, 45.0).direction();
        assert!(direction.x < -0.5 && direction.y < 0.0 && (direction.length() - 1.0).abs() < 1e-6, "{direction}");
    }
}
