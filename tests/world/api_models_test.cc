// SPDX-License-Identifier: GPL-2.0-or-later
//
// Stage's interface as clients use it: models.

#include "api_testing.hh"

// Clients cast various function types to callback types, and nest FOR_EACH.
#pragma GCC diagnostic ignored "-Wcast-function-type"
#pragma GCC diagnostic ignored "-Wshadow"

namespace {

// ---- Model --------------------------------------------------------------------------------------

TEST(Api, ModelTree) {
  static_assert(is_base_of<Ancestor, Model>::value, "");
  static_assert(has_virtual_destructor<Model>::value, "");
  static_assert(!is_copy_constructible<Model>::value && !is_copy_assignable<Model>::value, "");
  static_assert(is_constructible<Model, World*, Model*, const string&, const string&>::value, "");
  static_assert(is_constructible<Model, World*>::value, "");
  Has<map<string, creator_t>*>(&Model::name_map);
  Has<void (Model::*)(const string&)>(&Model::SetToken);
  Has<const string& (Model::*)() const>(&Model::GetModelType);
  Has<uint32_t (Model::*)() const>(&Model::GetId);
  Has<Model* (*)(uint32_t)>(&Model::LookupId);
  Has<string (Model::*)()>(&Model::PoseString);
  Has<void (Model::*)(char*) const>(&Model::Print);
  Has<const char* (Model::*)() const>(&Model::PrintWithPose);
  Has<World* (Model::*)() const>(&Model::GetWorld);
  Has<Model* (Model::*)() const>(&Model::Parent);
  Has<Model* (Model::*)()>(&Model::Root);
  Has<Model* (Model::*)(const string&) const>(&Model::GetChild);
  Has<Model* (Model::*)(const string&)>(&Model::GetUnusedModelOfType);
  Has<Model* (Model::*)(const string&) const>(&Model::GetUnsubscribedModelOfType);
  Has<bool (Model::*)(const Model*) const>(&Model::IsAntecedent);
  Has<bool (Model::*)(const Model*) const>(&Model::IsDescendent);
  Has<bool (Model::*)(const Model*) const>(&Model::IsRelated);
  Has<int (Model::*)(Model*)>(&Model::SetParent);
  Has<void (Model::*)(Model*)>(&Model::BecomeParentOf);
}

TEST(Api, ModelGeometry) {
  Has<Pose (Model::*)() const>(&Model::GetPose);
  Has<Pose (Model::*)() const>(&Model::GetGlobalPose);
  Has<void (Model::*)(const Pose&)>(&Model::SetPose);
  Has<void (Model::*)(const Pose&)>(&Model::SetGlobalPose);
  Has<void (Model::*)(const Pose&)>(&Model::AddToPose);
  Has<void (Model::*)(double, double, double, double)>(&Model::AddToPose);
  Has<Geom (Model::*)() const>(&Model::GetGeom);
  Has<void (Model::*)(const Geom&)>(&Model::SetGeom);
  Has<Pose (Model::*)(const Pose&) const>(&Model::GlobalToLocal);
  Has<Pose (Model::*)(const Pose&) const>(&Model::LocalToGlobal);
  Has<point_t (Model::*)(const point_t&) const>(&Model::LocalToGlobal);
  Has<vector<point_int_t> (Model::*)(const vector<point_t>&) const>(&Model::LocalToPixels);
  Has<void (Model::*)(meters_t, meters_t, meters_t, meters_t, meters_t)>(&Model::AddBlockRect);
  Has<void (Model::*)()>(&Model::ClearBlocks);
  Has<void (Model::*)(Worldfile*, int)>(&Model::LoadBlock);
  Has<void (Model::*)(uint8_t*, unsigned int, unsigned int, meters_t, meters_t)>(&Model::Rasterize);
  Has<bool (Model::*)()>(&Model::HasCollision);
  Has<bool (Model::*)(meters_t, meters_t, meters_t, meters_t, size_t)>(
      &Model::RandomPoseInFreeSpace);
  Has<bool (Model::*)(meters_t, meters_t, meters_t, meters_t, size_t)>(&Model::PlaceInFreeSpace);
  Has<kg_t (Model::*)() const>(&Model::GetTotalMass);
  Has<kg_t (Model::*)() const>(&Model::GetMassOfChildren);
  Has<void (Model::*)(kg_t)>(&Model::SetMass);
}

TEST(Api, ModelLife) {
  Has<void (Model::*)()>(&Model::Subscribe);
  Has<void (Model::*)()>(&Model::Unsubscribe);
  Has<unsigned int (Model::*)() const>(&Model::GetSubscriptionCount);
  Has<bool (Model::*)() const>(&Model::HasSubscribers);
  Has<usec_t (Model::*)()>(&Model::GetInterval);
  Has<usec_t (Model::*)() const>(&Model::GetUpdateInterval);
  Has<usec_t (Model::*)() const>(&Model::GetEnergyInterval);
  Has<bool (Model::*)() const>(&Model::DataIsFresh);
  Has<void (Model::*)()>(&Model::Enable);
  Has<void (Model::*)()>(&Model::Disable);
  Has<bool (Model::*)() const>(&Model::IsEnabled);
  Has<void (Model::*)(Worldfile*, int)>(&Model::Load);
  Has<void (Model::*)()>(&Model::Load);
  Has<void (Model::*)(Worldfile*, int)>(&Model::SetWorldfile);
  Has<void (Model::*)()>(&Model::Save);
  Has<void (Model::*)()>(&Model::InitControllers);
  Has<void (Model::*)(const char*)>(&Model::LoadControllerModule);
  Has<bool (Model::*)() const>(&Model::Stalled);
  Has<void (Model::*)(bool)>(&Model::SetStall);
}

TEST(Api, ModelCallbacks) {
  const Model::callback_type_t in_order[] = {
      Model::CB_FLAGDECR,    Model::CB_FLAGINCR, Model::CB_GEOM,   Model::CB_INIT,
      Model::CB_LOAD,        Model::CB_PARENT,   Model::CB_POSE,   Model::CB_SAVE,
      Model::CB_SHUTDOWN,    Model::CB_STARTUP,  Model::CB_UPDATE, Model::CB_VELOCITY,
      Model::__CB_TYPE_COUNT};
  for (int i = 0; i <= 12; i++) EXPECT_EQ(in_order[i], i);
  Has<void (Model::*)(Model::callback_type_t, model_callback_t, void*)>(&Model::AddCallback);
  Has<int (Model::*)(Model::callback_type_t, model_callback_t)>(&Model::RemoveCallback);
  Has<int (Model::*)(Model::callback_type_t)>(&Model::CallCallbacks);

  const model_callback_t function = [](Model*, void*) { return 0; };
  const world_callback_t world_function = [](World*, void*) { return 0; };
  int a[2];
  const Model::cb_t none, first(function, &a[0]), second(function, &a[1]), third(world_function, a);
  EXPECT_TRUE(first < second && !(second < first));
  EXPECT_TRUE(first == second);
  EXPECT_FALSE(first == none || first == third);
}

TEST(Api, ModelAppearance) {
  Has<Color (Model::*)() const>(&Model::GetColor);
  Has<void (Model::*)(Color)>(&Model::SetColor);
  Has<Visibility Model::*>(&Model::vis);
  const Visibility vis;
  EXPECT_TRUE(vis.blob_return && vis.fiducial_key == 0 && vis.fiducial_return == 0 &&
              !vis.gripper_return && vis.obstacle_return && vis.ranger_return == 1.0);
  Has<Visibility& (Visibility::*)(Worldfile*, int)>(&Visibility::Load);
  Has<void (Visibility::*)(Worldfile*, int)>(&Visibility::Save);
  Has<void (Model::*)(int)>(&Model::SetFiducialReturn);
  Has<int (Model::*)() const>(&Model::GetFiducialReturn);
  Has<void (Model::*)(int)>(&Model::SetFiducialKey);
  Has<void (Model::*)(bool)>(&Model::SetObstacleReturn);
  Has<void (Model::*)(bool)>(&Model::SetBlobReturn);
  Has<void (Model::*)(bool)>(&Model::SetGripperReturn);
  Has<void (Model::*)(double)>(&Model::SetRangerReturn);
  Has<void (Model::*)(bool)>(&Model::SetBoundary);
  Has<void (Model::*)(meters_t)>(&Model::SetMapResolution);
  Has<void (Model::*)(double)>(&Model::SetFriction);
  Has<void (Model::*)(bool)>(&Model::SetGuiNose);
  Has<void (Model::*)(bool)>(&Model::SetGuiMove);
  Has<void (Model::*)(bool)>(&Model::SetGuiGrid);
  Has<void (Model::*)(bool)>(&Model::SetGuiOutline);
  Has<void (Model::*)(watts_t)>(&Model::SetWatts);
  Has<PowerPack* (Model::*)() const>(&Model::FindPowerPack);
  Has<void (Model::*)(const string&)>(&Model::Say);
  Has<string (Model::*)()>(&Model::GetSayString);
  Has<void (Model::*)(Visualizer*, bool)>(&Model::AddVisualizer);
  Has<void (Model::*)(Visualizer*)>(&Model::RemoveVisualizer);
  Has<void (Model::*)()>(&Model::NeedRedraw);
  Has<void (Model::*)()>(&Model::Redraw);
  Has<void (Model::*)(Color)>(&Model::PushColor);
  Has<void (Model::*)(double, double, double, double)>(&Model::PushColor);
  Has<void (Model::*)()>(&Model::PopColor);
}

TEST(Api, FlagsPacksCameras) {
  Has<void (Model::*)(Model::Flag*)>(&Model::AddFlag);
  Has<void (Model::*)(Model::Flag*)>(&Model::RemoveFlag);
  Has<void (Model::*)(Model::Flag*)>(&Model::PushFlag);
  Has<Model::Flag* (Model::*)()>(&Model::PopFlag);
  Has<unsigned int (Model::*)() const>(&Model::GetFlagCount);
  static_assert(is_constructible<Model::Flag, const Color&, double>::value, "");
  Has<void (Model::Flag::*)(const Color&)>(&Model::Flag::SetColor);
  Has<void (Model::Flag::*)(double)>(&Model::Flag::SetSize);
  Has<Color (Model::Flag::*)()>(&Model::Flag::GetColor);
  Has<double (Model::Flag::*)()>(&Model::Flag::GetSize);
  Has<Model::Flag* (Model::Flag::*)(double)>(&Model::Flag::Nibble);

  static_assert(is_constructible<PowerPack, Model*>::value, "");
  static_assert(!is_convertible<Model*, PowerPack>::value, "explicit");
  Has<void (PowerPack::*)(Camera*)>(&PowerPack::Visualize);
  Has<joules_t (PowerPack::*)() const>(&PowerPack::RemainingCapacity);
  Has<void (PowerPack::*)(joules_t)>(&PowerPack::Add);
  Has<void (PowerPack::*)(joules_t)>(&PowerPack::Subtract);
  Has<void (PowerPack::*)(PowerPack*, joules_t)>(&PowerPack::TransferTo);
  Has<double (PowerPack::*)() const>(&PowerPack::ProportionRemaining);
  Has<void (PowerPack::*)(const char*) const>(&PowerPack::Print);
  Has<joules_t (PowerPack::*)() const>(&PowerPack::GetStored);
  Has<joules_t (PowerPack::*)() const>(&PowerPack::GetCapacity);
  Has<joules_t (PowerPack::*)() const>(&PowerPack::GetDissipated);
  Has<void (PowerPack::*)(joules_t)>(&PowerPack::SetCapacity);
  Has<void (PowerPack::*)(joules_t)>(&PowerPack::SetStored);
  Has<bool (PowerPack::*)() const>(&PowerPack::GetCharging);
  Has<void (PowerPack::*)()>(&PowerPack::ChargeStart);
  Has<void (PowerPack::*)()>(&PowerPack::ChargeStop);
  Has<void (PowerPack::*)(joules_t)>(&PowerPack::Dissipate);
  Has<void (PowerPack::*)(joules_t, const Pose&)>(&PowerPack::Dissipate);
  Has<joules_t*>(&PowerPack::global_stored);
  Has<joules_t*>(&PowerPack::global_capacity);
  Has<joules_t*>(&PowerPack::global_dissipated);
  Has<joules_t*>(&PowerPack::global_input);

  static_assert(is_abstract<Visualizer>::value && has_virtual_destructor<Visualizer>::value, "");
  Has<void (Visualizer::*)(Model*, Camera*)>(&Visualizer::Visualize);
  Has<const string& (Visualizer::*)()>(&Visualizer::GetMenuName);
  Has<const string& (Visualizer::*)()>(&Visualizer::GetWorldfileName);
  static_assert(is_constructible<StripPlotVis, float, float, float, float, size_t, Color, Color,
                                 const char*, const char*>::value,
                "");
  Has<void (StripPlotVis::*)(float)>(&StripPlotVis::AppendValue);

  static_assert(is_constructible<LogEntry, usec_t, Model*>::value, "");
  Has<vector<LogEntry>*>(&LogEntry::log);
  Has<size_t (*)()>(&LogEntry::Count);
  Has<void (*)()>(&LogEntry::Clear);
  Has<void (*)()>(&LogEntry::Print);

  static_assert(is_abstract<Camera>::value, "");
  Has<void (Camera::*)() const>(&Camera::Draw);
  Has<void (Camera::*)() const>(&Camera::SetProjection);
  for (double (Camera::*number)() const :
       {&Camera::yaw, &Camera::pitch, &Camera::x, &Camera::y, &Camera::z})
    EXPECT_EQ((OrthoCamera().*number)(), 0);
  Has<void (Camera::*)()>(&Camera::reset);
  Has<void (Camera::*)(Worldfile*, int)>(&Camera::Load);
  Has<double (PerspectiveCamera::*)() const>(&PerspectiveCamera::horizFov);
  Has<double (PerspectiveCamera::*)() const>(&PerspectiveCamera::vertFov);
  Has<double (PerspectiveCamera::*)() const>(&PerspectiveCamera::nearClip);
  Has<double (PerspectiveCamera::*)() const>(&PerspectiveCamera::farClip);
  Has<double (PerspectiveCamera::*)(double) const>(&PerspectiveCamera::realDistance);
}

// ---- positions and rangers ----------------------------------------------------------------------

TEST(Api, Positions) {
  using P = ModelPosition;
  static_assert(is_constructible<P, World*, Model*, const string&>::value, "");
  Has<void (P::*)(double, double, double)>(&P::SetSpeed);
  Has<void (P::*)(Velocity)>(&P::SetSpeed);
  Has<void (P::*)(double)>(&P::SetXSpeed);
  Has<void (P::*)(double)>(&P::SetYSpeed);
  Has<void (P::*)(double)>(&P::SetZSpeed);
  Has<void (P::*)(double)>(&P::SetTurnSpeed);
  Has<void (P::*)()>(&P::Stop);
  Has<void (P::*)(double, double, double)>(&P::GoTo);
  Has<void (P::*)(Pose)>(&P::GoTo);
  Has<void (P::*)(double, double, double)>(&P::SetAcceleration);
  Has<Velocity (P::*)() const>(&P::GetVelocity);
  Has<void (P::*)(const Velocity&)>(&P::SetVelocity);
  Has<Velocity (P::*)() const>(&P::GetGlobalVelocity);
  Has<void (P::*)(const Velocity&)>(&P::SetGlobalVelocity);
  Has<Velocity (P::*)() const>(&P::GetOdomError);
  Has<void (P::*)(Pose)>(&P::SetOdom);
  Has<Pose P::*>(&P::est_pose);
  Has<Pose P::*>(&P::est_pose_error);
  Has<Pose P::*>(&P::est_origin);
  Has<Bounds(P::*)[4]>(&P::velocity_bounds);
  Has<Bounds(P::*)[4]>(&P::acceleration_bounds);
  Has<vector<P::Waypoint> P::*>(&P::waypoints);
  Has<void (P::Waypoint::*)() const>(&P::Waypoint::Draw);
  const P::Waypoint here(1, 2, 3, 4, Color::blue), there(Pose(1, 2, 3, 4), Color::blue), none;
  EXPECT_EQ(here.pose, there.pose);
  EXPECT_EQ(here.color, there.color);
  EXPECT_TRUE(none.pose.IsZero());
  EXPECT_EQ(P::CONTROL_ACCELERATION + P::CONTROL_VELOCITY + P::CONTROL_POSITION, 3);
  EXPECT_EQ(P::LOCALIZATION_GPS + P::LOCALIZATION_ODOM, 1);
  EXPECT_EQ(P::DRIVE_DIFFERENTIAL + P::DRIVE_OMNI + P::DRIVE_CAR, 3);
  static_assert(sizeof(P::ControlMode) + sizeof(P::LocalizationMode) + sizeof(P::DriveMode), "");
}

TEST(Api, Rangers) {
  using S = ModelRanger::Sensor;
  static_assert(is_constructible<ModelRanger, World*, Model*, const string&>::value, "");
  Has<const vector<S>& (ModelRanger::*)() const>(&ModelRanger::GetSensors);
  Has<vector<S>& (ModelRanger::*)()>(&ModelRanger::GetSensorsMutable);
  Has<void (ModelRanger::*)(Worldfile*, int)>(&ModelRanger::LoadSensor);
  Has<void (ModelRanger::*)(char*) const>(&ModelRanger::Print);
  Has<Pose S::*>(&S::pose);
  Has<Size S::*>(&S::size);
  Has<Bounds S::*>(&S::range);
  Has<radians_t S::*>(&S::fov);
  Has<double S::*>(&S::angle_noise);
  Has<double S::*>(&S::range_noise);
  Has<double S::*>(&S::range_noise_const);
  Has<unsigned int S::*>(&S::sample_count);
  Has<Color S::*>(&S::color);
  Has<vector<meters_t> S::*>(&S::ranges);
  Has<vector<double> S::*>(&S::intensities);
  Has<vector<double> S::*>(&S::bearings);
  Has<string (S::*)() const>(&S::String);
  Has<void (S::*)(Worldfile*, int)>(&S::Load);
  const S sensor, copy = sensor;
  EXPECT_EQ(copy.range.max, 5);
  EXPECT_EQ(copy.fov, 0.1);
  EXPECT_EQ(copy.sample_count, 1u);
  EXPECT_TRUE(copy.ranges.empty() && copy.intensities.empty() && copy.bearings.empty());
}

}  // namespace
