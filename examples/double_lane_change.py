"""Two estimators on the double lane change of ISO 3888-1, slow and fast: the same car, the same IMU and readings."""

from imufmu import comparisons, simulate

FIGURES = ("tilt_rmse_deg", "tilt_max_deg", "external_acceleration_norm_rmse_m_s2")

print("speed    estimator", *FIGURES, sep="  ")
for kilometres_per_hour in (40, 80):
    result = simulate("vehicle_double_lane_change", parameters={"plant.final_speed": kilometres_per_hour / 3.6})
    found = {compared.component: compared.summary for compared in comparisons(result)}
    for estimator in ("rizun2008", "plumb"):  # without and with the speed of the wheels
        figures = (f"{found[estimator][name]:{len(name)}.3f}" for name in FIGURES)
        print(f"{kilometres_per_hour} km/h  {estimator:9}", *figures, sep="  ")
