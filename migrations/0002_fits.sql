-- Why: a fit is only worth its circumstances. A point keeps how sure its angle is, the power, the
-- range and the chirp, so that it can be fitted again; a fit keeps what it said of itself: method,
-- estimates with intervals, covariance, verdict, hash of the data, seed and version.
--
-- Whatever was stored before knows none of this: NULL.

ALTER TABLE observation ADD COLUMN theta_sd_rad REAL
    CHECK (theta_sd_rad BETWEEN 0 AND 1.5707963267948966);
ALTER TABLE observation ADD COLUMN power_w REAL CHECK (power_w > 0);
ALTER TABLE observation ADD COLUMN range_m REAL CHECK (range_m >= 0);
ALTER TABLE observation ADD COLUMN chirp INTEGER CHECK (chirp BETWEEN 0 AND 4294967295);

ALTER TABLE fit ADD COLUMN report TEXT CHECK (json_type(report) = 'object');
