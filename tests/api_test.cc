// SPDX-License-Identifier: GPL-2.0-or-later
//
// Stage's interface as its clients use it: that names and signatures are the ones they know (most
// of this is checked by the compiler), and that their idioms work. Like most clients, this file
// uses both namespaces as a whole.

#include <gtest/gtest.h>

#include <sstream>
#include <type_traits>

#include "stage.hh"

using namespace Stg;
using namespace std;

// Clients cast functions of all kinds to the types of callbacks, and nest FOR_EACH.
#pragma GCC diagnostic ignored "-Wcast-function-type"
#pragma GCC diagnostic ignored "-Wshadow"

namespace {

/// Compiles if something converts to the type: for pointers to functions and members, which are of
/// that type exactly (or of a base class).
template <class Type>
void Has(Type) {}

template <class Type, class Actual>
void Is(const Actual&) {
  static_assert(is_same<Type, Actual>::value, "another type is promised");
}

// ---- functions, constants, types ----------------------------------------------------------------

TEST(Api, Functions) {
  Has<void (*)(int*, char***)>(&Init);
  Has<bool (*)()>(&InitDone);
  Has<const char* (*)()>(&Version);
  Has<unsigned int (*)()>(&FullVersion);
  Has<void (*)()>(&RegisterModels);
  Has<double (*)(double)>(&rtod);
  Has<double (*)(double)>(&dtor);
  Has<double (*)(double)>(&normalize);
  Has<int (*)(int)>(&sgn);
  Has<double (*)(double)>(&sgn);
  Has<double (*)(double, double, double)>(&constrain);
  Has<int (*)(const string&, vector<vector<point_t> >&)>(&polys_from_image_file);
  Has<point_t* (*)()>(&unit_square_points_create);

  EXPECT_EQ(rtod(M_PI), 180);
  EXPECT_EQ(dtor(180), M_PI);
  EXPECT_EQ(normalize(M_PI), M_PI);
  EXPECT_EQ(normalize(-M_PI), -M_PI);
  EXPECT_NEAR(normalize(5), 5 - 2 * M_PI, 1e-15);
  EXPECT_EQ(sgn(0), 1);
  EXPECT_EQ(sgn(-2), -1);
  EXPECT_EQ(sgn(-0.5), -1.0);
  EXPECT_EQ(constrain(5, 0, 2), 2);
  EXPECT_GT(FullVersion(), 40300u);

  point_t* square = unit_square_points_create();
  EXPECT_TRUE(square[0] == point_t(0, 0) && square[1] == point_t(1, 0) &&
              square[2] == point_t(1, 1) && square[3] == point_t(0, 1));
  delete[] square;

  vector<int> numbers = {1, 2, 1, 3};
  EraseAll(1, numbers);
  EXPECT_EQ(numbers, (vector<int>{2, 3}));
}

TEST(Api, ConstantsAndTypes) {
  EXPECT_EQ(thousand * thousand, million);
  EXPECT_EQ(thousand * million, billion);
  EXPECT_EQ(FiducialNone, 0);
  for (const char* text : {COPYRIGHT, AUTHORS, WEBSITE, DESCRIPTION, LICENSE})
    EXPECT_GT(strlen(text), 0u);

  Is<uint32_t>(Stg::id_t());
  Is<double>(meters_t());
  Is<double>(radians_t());
  Is<double>(kg_t());
  Is<double>(joules_t());
  Is<double>(watts_t());
  Is<unsigned long>(msec_t());
  Is<uint64_t>(usec_t());
  Is<struct timeval>(Stg::time_t());
  Is<Model* (*)(World*, Model*, const string&)>(creator_t());
  Is<int (*)(Model*, void*)>(model_callback_t());
  Is<int (*)(World*, void*)>(world_callback_t());
  Is<bool (*)(Model*, const Model*, const void*)>(ray_test_func_t());

  fov_t fov;
  fov.range = Bounds(0, 1);
  fov.angle = 1;
  rotrect_t rectangle;
  rectangle.pose = Pose(1, 2, 3, 4);
  rectangle.size = Size(1, 2, 3);
  EXPECT_EQ(fov.range.max + rectangle.pose.a, 5);
}

TEST(Api, Macros) {
  vector<int> numbers = {1, 2, 3};
  const vector<int>& constant = numbers;
  int sum = 0;
  FOR_EACH(outer, numbers) FOR_EACH(inner, constant) sum += *outer * *inner;
  EXPECT_EQ(sum, 36);
  FOR_EACH(it, numbers)* it = 7;
  EXPECT_EQ(numbers, (vector<int>{7, 7, 7}));
  VAR(copy, numbers);
  Is<vector<int> >(copy);

  testing::internal::CaptureStderr();
  PRINT_ERR("none");
  PRINT_ERR1("%d", 1);
  PRINT_ERR2("%d %d", 1, 2);
  PRINT_ERR3("%d %d %d", 1, 2, 3);
  PRINT_ERR4("%d %d %d %d", 1, 2, 3, 4);
  PRINT_ERR5("%d %d %d %d %s", 1, 2, 3, 4, "five");
  const string errors = testing::internal::GetCapturedStderr();
  EXPECT_EQ(errors.find("\033[41merr\033[0m: none ("), 0u) << errors;
  EXPECT_NE(errors.find("1 2 3 4 five ("), string::npos) << errors;

  testing::internal::CaptureStdout();
  PRINT_WARN("none");
  PRINT_WARN1("%d", 1);
  PRINT_WARN2("%d %d", 1, 2);
  PRINT_WARN3("%d %d %d", 1, 2, 3);
  PRINT_WARN4("%d %d %d %d", 1, 2, 3, 4);
  PRINT_WARN5("%d %d %d %d %d", 1, 2, 3, 4, 5);
  PRINT_MSG("none");
  PRINT_MSG1("%d", 1);
  PRINT_MSG2("%d %d", 1, 2);
  PRINT_MSG3("%d %d %d", 1, 2, 3);
  PRINT_MSG4("%d %d %d %d", 1, 2, 3, 4);
  PRINT_MSG5("%d %d %d %d %d", 1, 2, 3, 4, 5);
  PRINT_DEBUG("none");
  PRINT_DEBUG1("%d", no_such_thing);
  PRINT_DEBUG2("%d", no, such);
  PRINT_DEBUG3("%d", no, such, thing);
  PRINT_DEBUG4("%d", no, such, thing, here);
  PRINT_DEBUG5("%d", no, such, thing, here, either);
  const string output = testing::internal::GetCapturedStdout();
  EXPECT_EQ(output.find("\033[44mwarn\033[0m: none ("), 0u) << output;
  EXPECT_NE(output.find("Stage: none\n"), string::npos) << output;
  EXPECT_EQ(output.find("debug"), string::npos) << output;
}

// ---- value classes ------------------------------------------------------------------------------

TEST(Api, Colors) {
  Has<bool (Color::*)(const Color&) const>(&Color::operator==);
  Has<bool (Color::*)(const Color&) const>(&Color::operator!=);
  Has<Color (*)()>(&Color::RandomColor);
  Has<void (Color::*)(const char*) const>(&Color::Print);
  Has<const Color& (Color::*)(Worldfile*, int)>(&Color::Load);
  static_assert(!is_convertible<string, Color>::value, "explicit");
  Color c;
  EXPECT_EQ(c, Color::red);
  c = Color(0.1, 0.2, 0.3);
  EXPECT_EQ(c.r + c.g + c.b + c.a, 1.6);
  EXPECT_EQ(Color("blue"), Color::blue);
  EXPECT_EQ(Color(string("no such colour")), Color(1, 0, 0, 1));
  for (const Color& one : {Color::green, Color::yellow, Color::magenta, Color::cyan})
    EXPECT_NE(one, Color::red);
}

TEST(Api, Poses) {
  Has<Pose (*)(meters_t, meters_t, meters_t, meters_t)>(&Pose::Random);
  Has<void (Pose::*)(const char*) const>(&Pose::Print);
  Has<string (Pose::*)() const>(&Pose::String);
  Has<bool (Pose::*)() const>(&Pose::IsZero);
  Has<void (Pose::*)()>(&Pose::Zero);
  Has<Pose (Pose::*)(const Pose&) const>(&Pose::operator+);
  Has<bool (Pose::*)(const Pose&) const>(&Pose::operator<);
  Has<bool (Pose::*)(const Pose&) const>(&Pose::operator==);
  Has<bool (Pose::*)(const Pose&) const>(&Pose::operator!=);
  Has<meters_t (Pose::*)(const Pose&) const>(&Pose::Distance);
  Has<Pose& (Pose::*)(Worldfile*, int, const char*)>(&Pose::Load);
  Has<void (Pose::*)(Worldfile*, int, const char*)>(&Pose::Save);
  static_assert(has_virtual_destructor<Pose>::value, "");
  static_assert(sizeof(Pose) == 40, "");

  static_assert(is_base_of<Pose, Velocity>::value, "");
  Has<void (Velocity::*)(const char*) const>(&Velocity::Print);
  Has<Velocity& (Velocity::*)(Worldfile*, int, const char*)>(&Velocity::Load);

  Pose p;
  EXPECT_TRUE(p.IsZero());
  p = {1, 2, 3, 0.5};
  EXPECT_EQ(p.x + p.y + p.z + p.a, 6.5);
  EXPECT_EQ(p.String(), "[ 1.000 2.000 3.000 0.500 ]");
  EXPECT_EQ((Pose(1, 0, 0, 0) + Pose(1, 1, 0, 0)), Pose(2, 1, 0, 0));
  EXPECT_EQ(Pose(0, 0, 9, 0).Distance(Pose(3, 4, 0, 1)), 5);
  EXPECT_TRUE(Velocity().IsZero());
  EXPECT_EQ(Velocity(1, 2, 3, 4).a, 4);
}

TEST(Api, SizesBoundsAndPoints) {
  Has<void (Size::*)()>(&Size::Zero);
  Has<Size& (Size::*)(Worldfile*, int, const char*)>(&Size::Load);
  Has<void (Size::*)(Worldfile*, int, const char*) const>(&Size::Save);
  const Size size;
  EXPECT_EQ(size.x + size.y + size.z, 1.8);
  EXPECT_EQ(Size(1, 2, 3).z, 3);

  Has<void (Geom::*)()>(&Geom::Zero);
  Has<void (Geom::*)(const char*) const>(&Geom::Print);
  Geom geom(Pose(1, 2, 3, 4), Size(5, 6, 7));
  EXPECT_EQ(geom.pose.y + geom.size.y, 8);
  geom.Zero();
  EXPECT_EQ(geom.size.x + geom.pose.x, 0);
  EXPECT_EQ(Geom().size.z, 1);

  Has<Bounds& (Bounds::*)(Worldfile*, int, const char*)>(&Bounds::Load);
  Has<double (Bounds::*)(double)>(&Bounds::Constrain);
  EXPECT_EQ(Bounds(-1, 1).Constrain(-3), -1);
  EXPECT_EQ(Bounds().max, 0);
  const bounds3d_t box(Bounds(0, 1), Bounds(2, 3), Bounds(4, 5));
  EXPECT_EQ(box.x.max + box.y.min + box.z.min + bounds3d_t().x.max, 7);

  point_t p(1, 2);
  p += point_t(-1, 5);
  EXPECT_TRUE(p == point_t(0, 7)) << "also if x becomes 0";
  EXPECT_TRUE(point_t() < p);
  EXPECT_EQ(point3_t(1, 2, 3).z + point3_t().x, 3);
  EXPECT_TRUE(point_int_t(1, 2) == point_int_t(1, 2) && point_int_t() < point_int_t(0, 1));
}

TEST(Api, Rays) {
  const Ray none;
  EXPECT_TRUE(!none.mod && none.origin.IsZero() && none.range == 0 && !none.func && !none.arg &&
              none.ztest);
  const Ray ray(nullptr, Pose(1, 2, 3, 4), 5.0, nullptr, &none, false);
  EXPECT_EQ(ray.arg, &none);
  EXPECT_FALSE(ray.ztest);
  const RaytraceResult nothing, result(Pose(1, 2, 3, 4), nullptr, Color::blue, 7);
  EXPECT_EQ(nothing.mod, nullptr);
  EXPECT_EQ(result.pose.x + result.range, 8);
  EXPECT_EQ(result.color, Color::blue);
}

TEST(Api, ControllerArguments) {
  CtrlArgs arguments("wander fast", "--slow");
  arguments.worldfile[0] = 'W';  // option parsers do that
  EXPECT_EQ(arguments.worldfile + arguments.cmdline, "Wander fast--slow");
}

// ---- Ancestor and World -------------------------------------------------------------------------

TEST(Api, Ancestor) {
  Has<vector<Model*>& (Ancestor::*)()>(&Ancestor::GetChildren);
  Has<void (Ancestor::*)(model_callback_t, void*)>(&Ancestor::ForEachDescendant);
  Has<const char* (Ancestor::*)() const>(&Ancestor::Token);
  Has<const string& (Ancestor::*)() const>(&Ancestor::TokenStr);
  Has<void (Ancestor::*)(const string&)>(&Ancestor::SetToken);
  Has<Pose (Ancestor::*)() const>(&Ancestor::GetGlobalPose);
  Has<void (Ancestor::*)(Model*)>(&Ancestor::AddChild);
  Has<void (Ancestor::*)(Model*)>(&Ancestor::RemoveChild);
  Ancestor ancestor;
  string key("key");
  ancestor.SetProperty(key, &ancestor);
  EXPECT_EQ(ancestor.GetProperty(key), &ancestor);
}

TEST(Api, World) {
  static_assert(is_base_of<Ancestor, World>::value, "");
  static_assert(has_virtual_destructor<World>::value, "");
  static_assert(World::DEFAULT_PPM == 50, "");
  Has<bool (World::*)(const string&)>(&World::Load);
  Has<bool (World::*)(istream&, const string&)>(&World::Load);
  Has<void (World::*)()>(&World::UnLoad);
  Has<void (World::*)()>(&World::Reload);
  Has<bool (World::*)(const char*)>(&World::Save);
  Has<Worldfile* (World::*)()>(&World::GetWorldFile);
  Has<Model* (World::*)(Model*, const string&)>(&World::CreateModel);

  Has<void (*)()>(&World::Run);
  Has<bool (*)()>(&World::UpdateAll);
  Has<bool (World::*)()>(&World::Update);
  Has<void (World::*)()>(&World::Start);
  Has<void (World::*)()>(&World::Stop);
  Has<void (World::*)()>(&World::TogglePause);
  Has<bool (World::*)() const>(&World::Paused);
  Has<bool World::*>(&World::paused);
  Has<usec_t World::*>(&World::sim_interval);
  Has<usec_t (World::*)() const>(&World::SimTimeNow);
  Has<uint64_t (World::*)()>(&World::UpdateCount);
  Has<uint64_t (World::*)() const>(&World::GetUpdateCount);
  Has<string (World::*)() const>(&World::ClockString);
  Has<void (World::*)(bool)>(&World::ShowClock);
  Has<bool (World::*)() const>(&World::TestQuit);
  Has<void (World::*)()>(&World::Quit);
  Has<void (World::*)()>(&World::QuitAll);
  Has<void (World::*)()>(&World::CancelQuit);
  Has<void (World::*)()>(&World::CancelQuitAll);
  Has<bool (World::*)()>(&World::PastQuitTime);
  Has<void (World::*)(world_callback_t, void*)>(&World::AddUpdateCallback);
  Has<int (World::*)(world_callback_t, void*)>(&World::RemoveUpdateCallback);
  Has<void (World::*)(unsigned int, usec_t, Model*, model_callback_t, void*)>(&World::Enqueue);
  Has<unsigned int (World::*)(Model*) const>(&World::GetEventQueue);
  Has<void (World::*)(Model*)>(&World::EnableEnergy);
  Has<void (World::*)(Model*)>(&World::DisableEnergy);
  Has<vector<string>*>(&World::args);
  Has<string*>(&World::ctrlargs);

  Has<Model* (World::*)(const string&) const>(&World::GetModel);
  Has<const set<Model*> (World::*)() const>(&World::GetAllModels);
  Has<Model* (World::*)()>(&World::GetGround);
  Has<Model * World::*>(&World::ground);
  Has<double (World::*)() const>(&World::Resolution);
  Has<const bounds3d_t& (World::*)() const>(&World::GetExtent);
  Has<RaytraceResult (World::*)(const Ray&)>(&World::Raytrace);
  Has<RaytraceResult (World::*)(const Pose&, const meters_t, const ray_test_func_t, const Model*,
                                const void*, const bool)>(&World::Raytrace);
  Has<void (World::*)(const Pose&, const meters_t, const radians_t, const ray_test_func_t,
                      const Model*, const void*, const bool, vector<RaytraceResult>&)>(
      &World::Raytrace);
  Has<int32_t (World::*)(meters_t) const>(&World::MetersToPixels);
  Has<point_int_t (World::*)(const point_t&) const>(&World::MetersToPixels);
  Has<void (World::*)(Model*)>(&World::AddModel);
  Has<void (World::*)(Model*)>(&World::RemoveModel);
  Has<void (World::*)(Model*, const string&)>(&World::AddModelName);
  Has<void (World::*)(PowerPack*)>(&World::AddPowerPack);
  Has<void (World::*)(PowerPack*)>(&World::RemovePowerPack);
  Has<void (World::*)(double, double, double, double)>(&World::RecordRay);
  Has<void (World::*)()>(&World::ClearRays);
  Has<void (World::*)(Model*)>(&World::Log);

  Has<bool (World::*)() const>(&World::IsGUI);
  Has<void (World::*)()>(&World::Redraw);
  Has<void (World::*)()>(&World::NeedRedraw);
  Has<Model* (World::*)() const>(&World::RecentlySelectedModel);
  Has<void (World::*)(Color)>(&World::PushColor);
  Has<void (World::*)(double, double, double, double)>(&World::PushColor);
  Has<void (World::*)()>(&World::PopColor);
  Has<void (World::*)(Option*)>(&World::RegisterOption);
}

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

// ---- idioms -------------------------------------------------------------------------------------

/// A client in the manner of a ROS node.
struct Node {
  vector<ModelPosition*> positions;
  vector<ModelRanger*> rangers;
  int steps = 0, position_updates = 0, ranger_updates = 0;
};

void SortOut(Model* mod, Node* node) {
  if (dynamic_cast<ModelPosition*>(mod)) node->positions.push_back((ModelPosition*)mod);
  if (mod->GetModelType() == "ranger") node->rangers.push_back(static_cast<ModelRanger*>(mod));
}

bool AfterStep(World* world, Node* node) {
  EXPECT_EQ(world->SimTimeNow(), (usec_t)++node->steps * 100000);
  return false;
}

int PositionUpdated(ModelPosition* position, Node* node) {
  EXPECT_EQ(position, node->positions[0]);
  node->position_updates++;
  return 0;
}

int RangerUpdated(ModelRanger* ranger, Node* node) {
  EXPECT_EQ(ranger, node->rangers[0]) << "a Model* is a ModelRanger*, byte for byte";
  FOR_EACH(sensor, ranger->GetSensors()) EXPECT_EQ(sensor->ranges.size(), sensor->sample_count);
  return ++node->ranger_updates == 3;  // enough
}

const char* const kWorld =
    "position( name \"r0\" ranger( name \"laser\" sensor( samples 5 ) ) )\n"
    "model( name \"wall\" pose [3 0 0 0] )";

TEST(Idioms, InitWithoutArguments) {
  int argc = 0;
  Init(&argc, NULL);
  EXPECT_TRUE(InitDone());
  EXPECT_TRUE(World::args.empty());
}

TEST(Idioms, InitWithAnybodysArguments) {
  char name[] = "node", remap[] = "__name:=stage", option[] = "--no-such-option";
  char* arguments[] = {name, remap, option, nullptr};
  char** argv = arguments;
  int argc = 3;
  Init(&argc, &argv);
  EXPECT_EQ(argc, 3);
  EXPECT_EQ(argv, arguments);
  EXPECT_STREQ(argv[2], "--no-such-option");
  EXPECT_EQ(World::args, (vector<string>{"node", "__name:=stage", "--no-such-option"}));
}

TEST(Idioms, ANodeSortsOutModelsAndListensToThem) {
  int argc = 0;
  Init(&argc, NULL);
  World* world = new World();
  istringstream content(kWorld);
  ASSERT_TRUE(world->Load(content));
  Node node;
  world->AddUpdateCallback((world_callback_t)AfterStep, &node);
  world->ForEachDescendant((model_callback_t)SortOut, &node);
  ASSERT_EQ(node.positions.size(), 1u);
  ASSERT_EQ(node.rangers.size(), 1u);
  EXPECT_EQ(node.rangers[0]->Parent(), node.positions[0]);
  node.positions[0]->AddCallback(Model::CB_UPDATE, (model_callback_t)PositionUpdated, &node);
  node.rangers[0]->AddCallback(Model::CB_UPDATE, (model_callback_t)RangerUpdated, &node);
  node.positions[0]->Subscribe();
  node.rangers[0]->Subscribe();
  world->Start();
  for (int i = 0; i < 5; i++) EXPECT_FALSE(world->UpdateAll());
  EXPECT_EQ(node.steps, 5);
  EXPECT_EQ(node.position_updates, 5);
  EXPECT_EQ(node.ranger_updates, 3);
  delete world;
}

TEST(Idioms, NamesMayBeStringsOrLiterals) {
  World world("my world", 50);
  istringstream content(kWorld);
  ASSERT_TRUE(world.Load(content, "t.world"));
  const string name("r0");
  EXPECT_EQ(world.GetModel("r0"), world.GetModel(name));
  ModelPosition* robot = (ModelPosition*)world.GetModel(name);
  EXPECT_EQ(robot->GetChild("laser"), robot->GetChild("ranger:0"));
  EXPECT_EQ(robot->GetChild("laser"), robot->GetUnusedModelOfType("ranger"));
  robot->Say("a literal");
  robot->SetPose({1, 2, 0, 0.5});
  robot->SetRangerReturn(1.0);
  robot->SetRangerReturn(-1.0);
  EXPECT_EQ(robot->velocity_bounds->max, 1.0);
  Ancestor* ancestor = (Ancestor*)robot;
  EXPECT_STREQ(ancestor->Token(), "r0");
  EXPECT_EQ((void*)ancestor, (void*)robot);
  EXPECT_EQ((void*)static_cast<Model*>((ModelRanger*)robot->GetChild("laser")),
            (void*)(ModelRanger*)robot->GetChild("laser"));
}

class MyType : public Model {
 public:
  MyType(World* world_, Model* parent_, const string& type_) : Model(world_, parent_, type_) {}
  static Model* Make(World* world, Model* parent, const string& type) {
    return new MyType(world, parent, type);
  }
  void Update(void) override {
    updates++;
    Model::Update();
  }
  int updates = 0;
};

TEST(Idioms, TypesOfOnesOwn) {
  Model::name_map["mytype"] = MyType::Make;
  World world;
  istringstream content("mytype( name \"mine\" alwayson 1 )");
  ASSERT_TRUE(world.Load(content));
  for (int i = 0; i < 3; i++) world.Update();
  MyType* mine = dynamic_cast<MyType*>(world.GetModel("mine"));
  ASSERT_NE(mine, nullptr);
  EXPECT_EQ(mine->updates, 3);
  EXPECT_NE(dynamic_cast<MyType*>(world.CreateModel(NULL, "mytype")), nullptr);
  Model::name_map.erase("mytype");
}

TEST(Idioms, FlagsAreHandedFromModelToModel) {
  World world;
  Model *giver = world.CreateModel(NULL, "model"), *taker = world.CreateModel(NULL, "position");
  giver->PushFlag(new Model::Flag(Color(0, 0.8, 0), 0.5));
  taker->PushFlag(giver->PopFlag());
  EXPECT_EQ(taker->GetFlagCount(), 1u);
  delete taker->PopFlag();
}

}  // namespace
