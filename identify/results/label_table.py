"""The arrays of every class of results: dimensions, then the fields that stand over them, each with its unit
where its name does not end with it; `$unit`: as the field `unit` says; `~` stands for a blank.
"""

from __future__ import annotations

_ROWS_95 = "value=$unit low_95=$unit high_95=$unit"

ARRAYS: dict[str, dict[str, str]] = {
    "Header": {"verdict_sentence": "verdict", "note": "notes"},
    # identify.results.tables
    "ParameterTable": {
        "name": "name unit initial=$unit value=$unit lower=$unit upper=$unit log free std=see~log"
        " low_95=$unit high_95=$unit status"
    },
    "StartTable": {
        "start": "cost evaluations seconds converged sentence",
        "start parameter": "initial=see~parameters/unit final=see~parameters/unit",
    },
    "Bodies": {
        "links": "links",
        "links row column": "pose",
        "vertex axis": "vertices=m",
        "vertex": "of_link",
        "triangle corner": "triangles",
        "skeleton_part": "bare",
        "missing": "missing",
    },
    "Geometry": {
        "nodes": "nodes point_names point_links",
        "nodes axis": "points=m",
        "skeleton_place axis": "skeleton=m",
        "segment end": "segments",
        "nodes direction axis": "axes",
        "skeleton_part": "skeleton_links",
    },
    "Modes": {
        "frequency_hz": "frequency_hz damping_ratio",
        "frequency_hz point axis": "point_shapes",
        "frequency_hz skeleton_place axis": "skeleton_shapes",
        "frequency_hz body shift_and_turn": "body_shapes",
    },
    "SettingTable": {"key": "key value source"},
    "Provenance": {"package": "packages", "input_files": "input_files input_sha256"},
    # identify.results.fit
    "ModePairs": {
        "measured_mode": "measured_frequency_hz measured_damping_ratio",
        "pair": "measured model mac",
        "measured_mode model_mode": "mac_matrix",
        "measured_mode point axis": "measured_shapes",
    },
    "FrfComparison": {
        "frequency_hz": "frequency_hz",
        "pair": "output input gap relative_error frac area_error",
        "frequency_hz pair": "measured=$unit initial=$unit fitted=$unit band_95=$unit noise=$unit coherence",
    },
    "MeasurementResult": {"joint": "posture_deg"},
    "PublishedValues": {"parameter": "value=see~parameters/unit", "mode": "frequency_hz damping_ratio"},
    "ProfileCurve": {
        "values": "values=see~parameters/unit rise",
        "": "low=see~parameters/unit high=see~parameters/unit",
    },
    "StatedUncertainty": {
        "error": "kind place change unit stated=$unit shift spread",
        "statement": "sentences",
        "kinds": "kinds",
        "parameter kinds": "parts",
        "unknown unknown_again": "root",
    },
    "FitResult": {
        "effect": "effects",
        "free free_again": "correlation",
        "combination": "singular_values",
        "combination free": "directions",
        "inseparable_pair": "inseparable",
        "progress progress_column": "history=see~documentation",
    },
    # identify.results.discovery
    "MarkTable": {"mark": "sentence", "mark axis": "at_m along"},
    "OptionTable": {"sentence": "sentence kind gap gap_validation parameters log_odds verdict"},
    "PartTable": {"part": "kind name gap share frequency_hz"},
    "GapByBand": {
        "measurements": "measurements",
        "edge": "bands_hz",
        "channels": "channels",
        "measurements band channels": "gap",
    },
    "StepResult": {"effect": "model", "rival": "alike"},
    "AddedEffects": {
        "sentence": "sentence kind config named parameters log_odds gap gap_validation probability"
    },
    "PlaceTable": {"sentence": "sentence gap unknowns"},
    "CurveTable": {
        "frequency_hz": "frequency_hz",
        "entries": "entries",
        "frequency_hz entries": "value=$unit std_real=$unit std_imag=$unit law=$unit",
        "sets": "sets agreement fitted",
        "laws": "laws law_gap law_log_odds",
    },
    # identify.results.modes
    "ModeTable": {
        "frequency_hz": "frequency_hz frequency_std_hz damping_ratio damping_std seen_frequency_hz"
        " seen_damping_ratio mpc mpd_deg doubt",
        "channels": "channels",
        "frequency_hz channels": "shapes",
        "references": "references",
        "frequency_hz references": "participation",
        "frequency_hz mode_again": "auto_mac",
    },
    "RejectedPoles": {"frequency_hz": "frequency_hz damping_ratio presence mpc mpd_deg reason why"},
    "StabilisationDiagram": {
        "pole": "order frequency_hz damping_ratio stable mark",
        "line_hz": "line_hz",
        "line_hz reference": "indicator=see~../frf/unit",
    },
    "Reciprocity": {"channels": "a b frac level error"},
    "Tones": {"frequency_hz": "frequency_hz width_hz kurtosis share multiple speed_hz"},
    "ShapeScaling": {
        "mode": "modal_mass_kg modal_mass_std_kg partner_hz reason",
        "added": "added_node added_kg",
    },
    "OutputOnly": {"mode channel": "shape_std"},
    "SetupPoles": {
        "setup": "setup",
        "frequency_hz": "frequency_hz",
        "frequency_hz setup": "own_hz own_damping_ratio expected_hz",
    },
    "AnalysedMeasurement": {"joint": "posture_deg", "mode point axis": "shapes"},
    # identify.results.map
    "PostureRows": {
        "name": "name",
        "name joints": "posture_deg",
        "name axis": "tool_m peak_m_per_n",
        "name mode": "frequency_hz frequency_low_95=Hz frequency_high_95=Hz damping_ratio damping_low_95"
        " damping_high_95",
        "name response force": "compliance_m_per_n",
        "name line_hz response force": "receptance_m_per_n band_95=m/N",
    },
    "LimitRows": {
        "feed_deg": "feed_deg",
        "": "most=see~kind",
        "posture feed_deg": "value=see~kind low_95=see~kind high_95=see~kind chatter_hz rpm",
    },
    "CorrectionRows": {
        "posture mode": "frequency_hz frequency_low_95=Hz frequency_high_95=Hz frequency_known damping_ratio"
        " damping_low_95 damping_high_95 damping_known",
        "posture axis": "peak_m_per_n peak_low_95=m/N peak_high_95=m/N peak_known",
    },
    "ProcessTable": {
        "quantity": "quantity numbers postures log_odds amplitude length_deg shared scatter",
    },
    "LeftOutTable": {
        "number": "measurement quantity item measured=see~quantity model=see~quantity corrected=see~quantity"
        " low_95=see~quantity high_95=see~quantity",
    },
    "Learnt": {"like_file": "like"},
    "MapResult": {"joints": "joints", "line_hz": "line_hz"},
    # identify.results.stability
    "DepthLimits": {"rpm": "rpm depth_m low_95=m high_95=m chatter_hz zeroth_order=m"},
    "LimitChecks": {"rpm": "rpm zeroth_order=m multi_frequency=m semi_discretization=m"},
    "TipReceptance": {
        "line_hz": "line_hz",
        "line_hz tool_response tool_force": "receptance=m/N band_95=m/N",
    },
    "StabilityResult": {
        "joints": "joints posture_deg",
        "axis": "tip_m",
        "tool_axis axis": "axes",
        "entry_and_exit": "engagement_deg",
        "cutting_direction": "cutting=N/m^2",
        "coupling_value": "coupling=m,~the~last~Hz",
        "feed_deg": "feed_deg feed_depth_m",
        "mode": "mode_hz mode_damping",
    },
    # identify.results.deflection
    "DeflectionRows": {
        "name": "name size_m size_low_95=m size_high_95=m",
        "name joints": "posture_deg target_deg",
        "name axis": "tip_m force_n deflection_m low_95=m high_95=m target_m",
        "name principal": "compliance=m/N compliance_low_95=m/N compliance_high_95=m/N",
        "name principal axis": "directions",
    },
    "DynamicDeflection": {"line_hz": "line_hz", "line_hz axis": "amplitude_m band_95=m"},
    "DeflectionResult": {"joints": "joints"},
    # identify.results.batch
    "JobTable": {
        "name": "name state error file attempts seconds converged gap cost relative_error",
        "name joint": "posture_deg",
        "name axis": "tool_m",
    },
    "ParametersByPosture": {
        "name": "name unit log joint_value=$unit joint_low_95=$unit joint_high_95=$unit",
        "fit name": "value=$unit std=see~log low_95=$unit high_95=$unit usable",
    },
    "ModesByPosture": {"fit mode": "frequency_hz damping_ratio measured_frequency_hz measured_damping_ratio"},
    "DependenceTable": {
        "parameter": "parameter count mean=see~../parameters/unit mean_low_95=see~../parameters/unit"
        " mean_high_95=see~../parameters/unit chi_square freedom p_value scatter=see~../parameters/log"
        " trend_joint slope_per_rad slope_std=1/rad slope_p_value depends"
    },
    "PopulationTable": {
        "parameter": "parameter log shared count mean=see~../parameters/unit"
        " mean_low_95=see~../parameters/unit mean_high_95=see~../parameters/unit scatter=see~log"
        " scatter_low_95=see~log scatter_high_95=see~log p_value differs",
        "fit parameter": "value=see~../parameters/unit low_95=see~../parameters/unit"
        " high_95=see~../parameters/unit",
    },
    # identify.results.motion and circular
    "Trace": {"tick column": "values=$unit"},
    "TrajectoryComparison": {
        "time_s": "time_s",
        "time_s joints": "measured=$unit initial=$unit simulated=$unit",
        "phases joints": "rms=$unit rms_initial=$unit",
        "": "noise=$unit",
    },
    "RecordResult": {
        "joints": "start_deg",
        "tick": "time_s",
        "phases": "phases",
        "phases end": "phase_s",
    },
    "TrialTable": {"name": "name round gap gap_validation kept log_odds"},
    "MotionResult": {
        "effect": "effects",
        "joints": "joints",
        "free_number free_again": "correlation",
        "progress progress_column": "history=see~documentation",
    },
    "Glitches": {"glitch": "joint angle=rad feedback=m end=m"},
    "ClosedLoopFrfs": {
        "joints": "start_deg",
        "excited": "joint",
        "frequency_hz": "frequency_hz",
        "frequency_hz output input": "velocity=rad/s/(N~m) acceleration=rad/s^2/(N~m)"
        " velocity_measured=rad/s/(N~m) acceleration_measured=rad/s^2/(N~m)",
    },
    "CircularTest": {"plane": "centre=m", "angle": "angle=rad error=m", "": "radius=m"},
    # identify.results.explain
    "EffectTable": {
        "name": "name kind sentence evidence chance rivals reading",
        "name joints": "share",
    },
    "StepTable": {"name": "name evidence", "name joints": "share rms_fit=$unit rms_judge=$unit"},
    "ValueTable": {
        "value_row": f"effect name unit {_ROWS_95} other=$unit other_low_95=$unit other_high_95=$unit at_edge"
    },
    "BoundTable": {"effect": f"effect unit {_ROWS_95}"},
    "Curves": {
        "time_s": "time_s",
        "time_s joints": "measured=$unit known=$unit explained=$unit used",
    },
    "Unseen": {"joints": "rms_start=$unit rms=$unit"},
    "PairTable": {
        "pair": "fitted judge",
        "effect": "effect",
        "pair joints": "rms_start=$unit rms=$unit",
        "pair effect": "share",
    },
    "Glossary": {"name": "name sentence"},
    "TargetResult": {
        "joints": "joints rms_fit_start=$unit rms_fit=$unit rms_judge_start=$unit rms_judge=$unit"
        " noise=$unit",
        "combination": "body_errors",
        "warning": "warnings",
    },
    "ExplainResult": {"unknown": "unknown", "conditioning": "conditioning"},
    # identify.results.joints
    "JointValues": {"name": f"name unit {_ROWS_95} status expected=$unit meaning"},
    "Series": {"x": "x=$x_unit y=$y_unit"},
    "CurveResult": {"statement": "said", "curve_note": "notes", "": "rms=$unit"},
    # identify.results.excite
    "ExcitedTable": {
        "name": "name unit expected=$unit promised=$unit random=$unit scatter=$unit error=$unit held kept"
        " wanted"
    },
    "ExciteResult": {
        "joints": "joints centre=rad",
        "time_s": "time_s",
        "time_s joints": "position=rad velocity=rad/s acceleration=rad/s^2",
        "limit joints": "limits=rad,~rad/s,~rad/s^2",
        "harmonic joints": "sine=rad cosine=rad",
    },
    # identify.results.plan
    "PromisedTable": {"name": "name unit value=$unit now promised random"},
    "Worth": {"postures": "postures", "impacts": "impacts", "sensors": "sensors"},
    "PlanResult": {
        "joints": "joints",
        "posture joints": "posture_deg",
        "impacts": "impacts",
        "sensors": "sensors sensor_names sensor_links",
        "sensors axis": "sensor_m",
        "sensors direction axis": "sensor_axes",
        "posture impacts sensors": "level=m/s^2/N",
        "": "noise_floor=m/s^2/N",
        "edge": "band_hz",
        "of": "candidates",
    },
}
