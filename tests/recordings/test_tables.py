"""Text tables of any make: what is read is what the file says, in our units, and what was assumed is said."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from imufmu.blocks.rotations import euler_from_quaternion, over_rows
from imufmu.recordings.reading import RecordingError, read
from support.rocking import GRAVITY, lines_of, rocking

MOTION = rocking(8.0)
TIME, GYRO, ACCEL, MAG = (MOTION[name] for name in ("time", "gyro", "accel", "mag"))
DEG = np.rad2deg(GYRO)
OURS = "time,gyro[1],gyro[2],gyro[3],accel[1],accel[2],accel[3]"


def file(folder: Path, text: str | bytes, name: str = "walk.csv") -> Path:
    path = folder / name
    path.write_bytes(text.encode() if isinstance(text, str) else text)
    return path


def same(recording, atol: float = 1e-6) -> bool:
    """The readings of the motion, to the digits that were written."""
    return (
        np.allclose(recording.gyro, GYRO, atol=atol)
        and np.allclose(recording.accel, ACCEL, atol=10 * atol)
        and recording.sample_period == 0.01
    )


# How it is written


@pytest.mark.parametrize(
    ("change", "name"),
    [
        (lambda t: t.replace(",", ";"), "semicolons.csv"),
        (lambda t: t.replace(",", "\t"), "tabs.tsv"),
        (lambda t: t.replace(",", "|"), "bars.dat"),
        (lambda t: t.replace(",", " "), "spaces.txt"),
        (lambda t: t.replace(",", "   "), "more_spaces.txt"),
        (lambda t: t.replace(",", ";").replace(".", ","), "decimal_commas.csv"),
        (lambda t: "sep=;\n" + t.replace(",", ";"), "sep.csv"),
        (lambda t: "\ufeff" + t, "mark.csv"),
        (lambda t: "# a device\n# of someone, somewhere\n" + t, "comments.csv"),
        (lambda t: "Device:,Number 1\nRate:,100 Hz\n\n" + t, "facts.csv"),
        (lambda t: "# " + t, "header_in_a_comment.csv"),
        (lambda t: t.replace("\n", ",\n"), "trailing_commas.csv"),
        (lambda t: OURS + t[len(OURS) :].replace("\n", ",\n").lstrip(","), "trailing_commas_in_the_rows_only.csv"),
        (lambda t: t.replace("\n", "\r\n"), "windows.csv"),
        (lambda t: t + "# partial: the run ended early\n", "remark_at_the_end.csv"),
        (lambda t: t.encode("utf-16"), "utf_16.csv"),
        (lambda t: ("# in °/s\n" + t).encode("cp1252"), "western.csv"),
    ],
    ids=lambda value: value if isinstance(value, str) else "",
)
def test_a_table_is_read_however_it_was_written(tmp_path, change, name):
    recording = read(file(tmp_path, change(lines_of(OURS, TIME, GYRO, ACCEL)), name))
    assert same(recording)
    assert recording.notes == ()


def test_units_in_the_header_are_taken_at_their_word(tmp_path):
    header = "t [ms];Gyro X [°/s];Gyro Y [°/s];Gyro Z [°/s];Acc X (g);Acc Y (g);Acc Z (g)"
    recording = read(file(tmp_path, lines_of(header, 1e3 * TIME, DEG, ACCEL / GRAVITY, separator=";")))
    assert same(recording)
    assert "gyro=Gyro X,Gyro Y,Gyro Z" in recording.notes[0]


def test_our_names_with_a_unit_are_converted(tmp_path):
    header = OURS.replace("gyro[1]", "gyro[1] [deg/s]").replace("accel[3]", "accel[3] (g)")
    mixed = np.column_stack([DEG[:, 0], GYRO[:, 1:]])
    recording = read(file(tmp_path, lines_of(header, TIME, mixed, ACCEL[:, :2], ACCEL[:, 2] / GRAVITY)))
    assert same(recording)


def test_units_that_nobody_tells_are_found_in_the_values_and_said(tmp_path):
    recording = read(file(tmp_path, lines_of("time,gx,gy,gz,ax,ay,az", 1e3 * TIME, DEG, ACCEL / GRAVITY)))
    assert same(recording)
    said = " ".join(recording.notes)
    for words in ("gyro is taken for deg/s", "accel is taken for g", "times are taken for milliseconds"):
        assert words in said


def test_a_unit_that_the_values_do_not_tell_is_asked_for(tmp_path):
    """A gyroscope at rest: 0.002 of what?"""
    still = np.column_stack([0.002 * np.sin(TIME), 0 * TIME, 0 * TIME])
    upright = np.tile([0, 0, GRAVITY], (len(TIME), 1))
    path = file(tmp_path, lines_of("time,gx,gy,gz,ax,ay,az", TIME, still, upright))
    with pytest.raises(
        RecordingError, match=r"unit of gyro: .*--columns gyro=gx,gy,gz:rad/s \(or deg/s; counts as deg/s/131\)"
    ):
        read(path)
    assert np.allclose(read(path, columns=["gyro=gx,gy,gz:deg/s"]).gyro, np.deg2rad(still), atol=1e-8)


# Columns that are told


def test_columns_are_told_with_units_and_signs(tmp_path):
    header = "zeit,wx,wy,wz,bx,by,bz"
    path = file(tmp_path, lines_of(header, 1e6 * TIME, DEG * [1, -1, 1], ACCEL / GRAVITY))
    columns = ["gyro=wx,-wy,wz:deg/s", "accel=bx,by,bz:g", "time=zeit:us"]
    recording = read(path, columns=columns)
    assert same(recording)
    assert recording.notes == ()
    assert same(read(path, columns={"gyro": "wx,-wy,wz:deg/s", "accel": "5,6,7:g", "time": "1:us"}))


def test_a_table_without_a_header_is_read_by_numbers(tmp_path):
    path = file(tmp_path, lines_of("", TIME, GYRO, ACCEL).lstrip())
    with pytest.raises(RecordingError, match="tell them by number: --columns time=1"):
        read(path)
    assert same(read(path, columns=["time=1", "gyro=2,3,4", "accel=5,6,7"]))


@pytest.mark.parametrize(
    ("columns", "message"),
    [
        ("giro=a,b,c", "no signal is called 'giro'.*did you mean gyro"),
        ("gyro=a,b", "give 3 columns, as gyro="),
        ("gyro=a,b,c:furlong", "unknown unit 'furlong'; there is rad/s"),
        ("time=", "give one column"),
        ("gyro=wx,wy,none", "no column 'none' for gyro; the columns are"),
        ("gyro=wx,wy,99", "no column '99' for gyro"),
    ],
)
def test_columns_that_cannot_be_are_refused(tmp_path, columns, message):
    path = file(tmp_path, lines_of("time,wx,wy,wz,ax,ay,az", TIME, GYRO, ACCEL))
    with pytest.raises(RecordingError, match=message):
        read(path, columns=[columns])


def test_names_with_commas_and_colons_are_quoted(tmp_path):
    header = '"time","rate: x, left","rate: y","rate: z",ax,ay,az'
    path = file(tmp_path, lines_of(header, TIME, DEG, ACCEL))
    recording = read(path, columns=['gyro="rate: x, left","rate: y","rate: z":deg/s'])
    assert same(recording)


def test_two_sensors_in_one_file_are_asked_about(tmp_path):
    header = "time,a_gyro_x,a_gyro_y,a_gyro_z,b_gyro_x,b_gyro_y,b_gyro_z,acc_x,acc_y,acc_z"
    path = file(tmp_path, lines_of(header, TIME, GYRO, DEG, ACCEL))
    with pytest.raises(RecordingError, match="gyro could be a_gyro_x,a_gyro_y,a_gyro_z or b_gyro_x"):
        read(path)
    assert same(read(path, columns=["gyro=b_gyro_x,b_gyro_y,b_gyro_z:deg/s"]))


def test_a_speed_that_is_not_valid_is_missing(tmp_path):
    speed, valid = 2 + 0 * TIME, (TIME < 1).astype(float)
    text = lines_of(OURS + ",forward_speed (km/h),forward_speed_valid", TIME, GYRO, ACCEL, 3.6 * speed, valid)
    found = read(file(tmp_path, text)).forward_speed
    assert np.allclose(found[TIME < 1], 2, atol=1e-6)
    assert np.isnan(found[TIME >= 1]).all()


@pytest.mark.parametrize(
    "stamp", ["2026-03-01T{0}", "2026-03-01 {0}", "2026-03-01T{0}Z", "2026-03-01T{0}+01:00", "{0}"]
)
def test_dates_and_times_of_day_are_seconds(tmp_path, stamp):
    rows = lines_of("", GYRO, ACCEL).strip().splitlines()
    times = [stamp.format(f"23:59:{56 + t:09.6f}") for t in TIME if t < 4] + [
        stamp.replace("03-01", "03-02").format(f"00:00:{t - 4:09.6f}") for t in TIME if t >= 4
    ]
    text = "\n".join([OURS, *(f"{time},{row}" for time, row in zip(times, rows, strict=True))])
    recording = read(file(tmp_path, text))
    assert same(recording)
    assert np.array_equal(recording.sample_index, np.arange(len(TIME)))  # over midnight, too


def test_acceleration_without_gravity_is_not_taken_where_there_is_one_with_it(tmp_path):
    header = "time,gx,gy,gz,Linear Acceleration x,Linear Acceleration y,Linear Acceleration z,ax,ay,az"
    path = file(tmp_path, lines_of(header, TIME, GYRO, ACCEL - ACCEL.mean(axis=0), ACCEL))
    assert same(read(path))
    lonely = lines_of(",".join(header.split(",")[:7]) + " (m/s2)", TIME, GYRO, 0.1 * np.sin(ACCEL))
    path = file(tmp_path, lonely.replace("tion x,", "tion x (m/s2),").replace("tion y,", "tion y (m/s2),"))
    assert any("was gravity taken out" in note for note in read(path, columns=["gyro=gx,gy,gz:rad/s"]).notes)


# Files of well-known devices


def test_xsens_text_export_counts_its_packets(tmp_path):
    above = (
        "// Start Time: Unknown\n// Update Rate: 100.0Hz\n// Filter Profile: human (46.1)\n// Firmware Version: 4.6.0"
    )
    header = "PacketCounter SampleTimeFine Acc_X Acc_Y Acc_Z Gyr_X Gyr_Y Gyr_Z Mag_X Mag_Y Mag_Z".replace(" ", "\t")
    counter = (65000 + np.arange(len(TIME))) % 65536
    rows = [
        "\t".join([f"{c:05d}", "", *(f"{x:.6f}" for x in [*a, *g, *m])])
        for c, a, g, m in zip(counter, ACCEL, GYRO, MAG / 50, strict=True)
    ]
    kept = np.delete(np.arange(len(TIME)), [300, 301])
    recording = read(file(tmp_path, "\n".join([above, header, *(rows[i] for i in kept)]), "MT_01.txt"))
    assert recording.sample_period == 0.01
    assert np.allclose(recording.gyro, GYRO[kept], atol=1e-6)
    assert np.array_equal(recording.sample_index, kept)  # over the wrap of the counter, and over the lost packets
    assert np.allclose(recording.mag, MAG[kept], atol=1e-4)
    said = " ".join(recording.notes)
    for words in ("Xsens MT", "counted by PacketCounter at the 100 Hz", "begin anew at 65536", "2 of 800 samples"):
        assert words in said


def test_xsens_fine_time_is_in_tenths_of_milliseconds(tmp_path):
    above = "// Start Time: Unknown\n// Update Rate: 100.0Hz\n"
    header = "PacketCounter,SampleTimeFine,Acc_X,Acc_Y,Acc_Z,Gyr_X,Gyr_Y,Gyr_Z"
    text = lines_of(above + header, np.arange(len(TIME)), 1e4 * TIME + 5e6, ACCEL, GYRO)
    assert same(read(file(tmp_path, text, "MT.txt")))


def test_movella_dot_writes_degrees_and_microseconds(tmp_path):
    above = "sep=,\nDeviceTag:,Left\nFirmwareVersion:,2.0.0\nOutputRate:,100Hz\nMeasurement Mode:,Custom mode 4\n\n"
    header = "PacketCounter,SampleTimeFine,Quat_W,Quat_X,Quat_Y,Quat_Z,Acc_X,Acc_Y,Acc_Z,Gyr_X,Gyr_Y,Gyr_Z,Status"
    quaternion = np.tile([1.0, 0, 0, 0], (len(TIME), 1))
    stamps = (2**32 - 3e6 + 1e6 * TIME) % 2**32
    text = lines_of(above + header, np.arange(len(TIME)), stamps, quaternion, ACCEL, DEG, 0 * TIME)
    recording = read(file(tmp_path, text))
    assert same(recording)
    assert "Movella DOT" in recording.notes[0]
    free = above + "PacketCounter,SampleTimeFine,Euler_X,Euler_Y,Euler_Z,FreeAcc_X,FreeAcc_Y,FreeAcc_Z,Status"
    with pytest.raises(RecordingError, match="free acceleration has no gravity"):
        read(file(tmp_path, lines_of(free, np.arange(len(TIME)), stamps, DEG, ACCEL, 0 * TIME)))


def test_shimmer_has_a_line_of_units(tmp_path):
    names = ["Timestamp_Unix", "Accel_LN_X", "Accel_LN_Y", "Accel_LN_Z", "Accel_WR_X", "Accel_WR_Y", "Accel_WR_Z"]
    names += ["Gyro_X", "Gyro_Y", "Gyro_Z", "Mag_X", "Mag_Y", "Mag_Z"]
    header = "\t".join(f"Shimmer_40AC_{name}_CAL" for name in names)
    units = "\t".join(["ms", *["m/(s^2)"] * 6, *["deg/s"] * 3, *["local_flux"] * 3])
    text = lines_of(
        f'"sep=\t"\n{header}\n{units}', 1.6e12 + 1e3 * TIME, ACCEL, 0.9 * ACCEL, DEG, MAG / 50, separator="\t"
    )
    recording = read(file(tmp_path, text))
    assert same(recording)
    assert np.allclose(recording.mag, MAG, atol=1e-4)
    assert recording.time[0] == pytest.approx(1.6e9)


def test_files_of_phyphox_and_x_io_tell_their_units(tmp_path):
    phyphox = '"Time (s)";"Acceleration x (m/s^2)";"Acceleration y (m/s^2)";"Acceleration z (m/s^2)"'
    phyphox += ';"Gyroscope x (rad/s)";"Gyroscope y (rad/s)";"Gyroscope z (rad/s)"'
    assert same(read(file(tmp_path, lines_of(phyphox, TIME, ACCEL, GYRO, separator=";"))))
    ngimu = "Time (s),Gyroscope X (deg/s),Gyroscope Y (deg/s),Gyroscope Z (deg/s),Accelerometer X (g),"
    ngimu += "Accelerometer Y (g),Accelerometer Z (g),Magnetometer X (uT),Magnetometer Y (uT),Magnetometer Z (uT)"
    assert same(read(file(tmp_path, lines_of(ngimu, TIME, DEG, ACCEL / GRAVITY, MAG), "sensors.csv")))
    ximu = ngimu.replace("Time (s)", "Packet number").replace("uT", "G")
    path = file(
        tmp_path, lines_of(ximu, np.arange(len(TIME)) * 2 + 115, DEG, ACCEL / GRAVITY, MAG / 100), "CalInertial.csv"
    )
    with pytest.raises(RecordingError, match=r"missing: time \(s\).*or without times --rate 100"):
        read(path)
    recording = read(path, rate=100.0)
    assert same(recording)
    assert np.allclose(recording.mag, MAG, atol=1e-4)


def test_what_says_nothing_of_a_file_is_refused_and_not_passed_over(tmp_path):
    path = file(tmp_path, lines_of(OURS, TIME, GYRO, ACCEL))
    with pytest.raises(RecordingError, match="--stream is for logs"):
        read(path, stream="imu 1")
    with pytest.raises(RecordingError, match="has no columns to tell"):
        read(tmp_path / "a.mat", columns=["time=t"])


# Rows


def test_rows_that_are_written_twice_count_once(tmp_path):
    header, *rows = lines_of(OURS, TIME, GYRO, ACCEL).splitlines()
    doubled = [row for i, row in enumerate(rows) for row in [row] * (1 + (i % 10 == 0))]
    recording = read(file(tmp_path, "\n".join([header, *doubled])))
    assert same(recording)
    assert "80 rows repeat the row before them, time and all, and are left out" in recording.notes


def test_equal_stamps_of_different_readings_are_samples_of_their_own(tmp_path):
    recording = read(file(tmp_path, lines_of(OURS, TIME // 0.02 * 0.02, GYRO, ACCEL)))
    assert same(recording)


def test_counts_of_a_device_are_told_with_their_scale(tmp_path):
    counts = (np.round(DEG * 131), np.round(ACCEL / GRAVITY * 16384))
    path = file(tmp_path, lines_of("millis,gx,gy,gz,ax,ay,az", 1e3 * TIME, *counts, digits=0))
    with pytest.raises(RecordingError, match="counts as g/16384"):
        read(path, columns=["time=millis:ms"])
    recording = read(path, columns=["time=millis:ms", "gyro=gx,gy,gz:deg/s/131", "accel=ax,ay,az:g/16384"])
    assert same(recording, atol=0.5 / 131 * np.pi / 180)  # half a count; ten times that covers one of the accelerometer


def test_angles_of_another_make_are_said_to_be_the_truth_and_their_unit_is_found(tmp_path):
    roll, pitch, yaw = over_rows(euler_from_quaternion, MOTION["q_NS"]).T
    header = "time,gyro_x,gyro_y,gyro_z,acc_x,acc_y,acc_z,roll,pitch,yaw"
    path = file(tmp_path, lines_of(header, TIME, GYRO, ACCEL, *np.rad2deg([roll, pitch, yaw])))
    recording = read(path)
    np.testing.assert_allclose(recording.truth["roll"], roll, atol=1e-8)  # of seven digits in degrees
    said = " ".join(recording.notes)
    assert "roll, pitch, yaw are taken for the truth" in said and "roll is taken for deg" in said


def test_a_magnetometer_in_unknown_units_keeps_its_direction(tmp_path):
    header = "time,gyro_x,gyro_y,gyro_z,acc_x,acc_y,acc_z,mag_x,mag_y,mag_z"
    recording = read(file(tmp_path, lines_of(header, TIME, GYRO, ACCEL, 1e-3 * MAG)))
    lengths = np.linalg.norm(recording.mag, axis=1)
    assert np.median(lengths) == pytest.approx(50)
    np.testing.assert_allclose(
        recording.mag / lengths[:, None], MAG / np.linalg.norm(MAG, axis=1)[:, None], atol=1e-5
    )  # of 50 in seven digits, a thousandth of it written
    assert any("nothing tells the unit of mag" in note for note in recording.notes)
